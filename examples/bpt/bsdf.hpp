// How surfaces scatter. BSDFs are evaluated and sampled around the shading normal; nothing passes where the
// geometric normal sees the two directions on different sides.
#pragma once

#include "medium.hpp"

namespace bpt {

template <class Real> bool is_dirac(const material<Real>& m) {
    return m.kind == material_kind::mirror || m.kind == material_kind::glass;
}

// Directions point away from the surface. All functions are symmetric in them but for the densities.
template <class Real>
bool can_reflect(const surface_point<Real>& x, const vec3<Real>& from, const vec3<Real>& to) {
    return dot(x.normal, from) * dot(x.normal, to) > Real(0) &&
           dot(x.shading_normal, from) * dot(x.shading_normal, to) > Real(0);
}

template <class Real>
Real lobe_cosine(const surface_point<Real>& x, const vec3<Real>& from, const vec3<Real>& to) {
    return dot(2 * dot(x.shading_normal, from) * x.shading_normal - from, to);
}

// f, without a cosine. Black for Dirac materials. Phase functions' is per length.
template <class Real>
color<Real> evaluate(const material<Real>& m, const surface_point<Real>& x, const vec3<Real>& from,
                     const vec3<Real>& to) {
    if (m.kind == material_kind::phase)
        return m.diffuse * phase_density(m.exponent, -dot(from, to));
    if (is_dirac(m) || !can_reflect(x, from, to))
        return color<Real>(0);
    if (m.kind != material_kind::glossy)
        return m.diffuse / pi<Real>;
    const Real cosine = lobe_cosine(x, from, to);
    const Real lobe =
        cosine > Real(0) ? (m.exponent + 2) / (2 * pi<Real>)*std::pow(cosine, m.exponent) : Real(0);
    return m.diffuse / pi<Real> + m.specular * lobe;
}

template <class Real> Real diffuse_share(const material<Real>& m) {
    const Real diffuse = m.diffuse.x + m.diffuse.y + m.diffuse.z;
    const Real specular = m.specular.x + m.specular.y + m.specular.z;
    return m.kind == material_kind::glossy ? diffuse / (diffuse + specular) : Real(1);
}

// Density per solid angle of leaving towards `to`, coming from the side of `from`; roulette included.
template <class Real>
Real density(const material<Real>& m, const surface_point<Real>& x, const vec3<Real>& from,
             const vec3<Real>& to) {
    if (is_dirac(m))
        return Real(0);
    if (m.kind == material_kind::phase)
        return m.survival * phase_density(m.exponent, -dot(from, to));
    const Real side = dot(x.shading_normal, from) > Real(0) ? Real(1) : Real(-1);
    const Real diffuse = std::max(Real(0), side * dot(x.shading_normal, to)) / pi<Real>;
    const Real share = diffuse_share(m);
    const Real lobe = share < Real(1) ? lobe_density(lobe_cosine(x, from, to), m.exponent) : Real(0);
    return m.survival * (share * diffuse + (1 - share) * lobe);
}

// A direction with that density, given that the walk survives.
template <class Real>
vec3<Real> sample(const material<Real>& m, const surface_point<Real>& x, const vec3<Real>& from, pcg32& rng) {
    if (m.kind == material_kind::phase)
        return sample_phase(m.exponent, -from, rng);
    const vec3<Real> normal = dot(x.shading_normal, from) > Real(0) ? x.shading_normal : -x.shading_normal;
    if (uniform<Real>(rng) < diffuse_share(m))
        return sample_lobe(normal, Real(1), rng);
    return sample_lobe(normalize(2 * dot(normal, from) * normal - from), m.exponent, rng);
}

// Mirror and glass: one of two lobes. `value` is what the throughput is multiplied with where light travels,
// f |cos| without its Dirac factor; `probability` that of the lobe, roulette included, the same in the other
// direction.
template <class Real> struct dirac_lobe {
    vec3<Real> to;
    color<Real> value;
    Real probability = 0;
    Real eta_from = 1, eta_to = 1;
};

// Fresnel reflectance of a dielectric and the cosine of the refracted direction (0: total reflection).
template <class Real> Real fresnel(Real cos_from, Real eta_from, Real eta_to, Real& cos_to) {
    const Real ratio = eta_from / eta_to;
    const Real sin2 = ratio * ratio * (1 - cos_from * cos_from);
    cos_to = std::sqrt(std::max(Real(0), 1 - sin2));
    if (sin2 >= Real(1))
        return Real(1);
    const Real parallel = (eta_to * cos_from - eta_from * cos_to) / (eta_to * cos_from + eta_from * cos_to);
    const Real across = (eta_from * cos_from - eta_to * cos_to) / (eta_from * cos_from + eta_to * cos_to);
    return (parallel * parallel + across * across) / 2;
}

// The lobe that reflects (or refracts) a direction; `reflects` chooses.
template <class Real>
dirac_lobe<Real> dirac_scatter(const material<Real>& m, const surface_point<Real>& x, const vec3<Real>& from,
                               bool reflects) {
    const bool outside = dot(x.normal, from) > Real(0);
    const vec3<Real> normal = outside ? x.normal : -x.normal;
    const Real cosine = dot(normal, from);
    dirac_lobe<Real> lobe;
    lobe.eta_from = outside || m.kind == material_kind::mirror ? Real(1) : m.eta;
    const Real eta_beyond = m.kind == material_kind::mirror ? Real(1) : outside ? m.eta : Real(1);
    Real cos_beyond = 0;
    const Real reflectance =
        m.kind == material_kind::mirror ? Real(1) : fresnel(cosine, lobe.eta_from, eta_beyond, cos_beyond);
    const Real share = reflects ? reflectance : 1 - reflectance;
    lobe.eta_to = reflects ? lobe.eta_from : eta_beyond;
    lobe.value = share * m.specular;
    lobe.probability = share * m.survival;
    const Real ratio = lobe.eta_from / eta_beyond;
    lobe.to = normalize(reflects ? 2 * cosine * normal - from
                                 : ratio * (cosine * normal - from) - cos_beyond * normal);
    return lobe;
}

template <class Real>
dirac_lobe<Real> sample_dirac(const material<Real>& m, const surface_point<Real>& x, const vec3<Real>& from,
                              pcg32& rng) {
    const dirac_lobe<Real> reflection = dirac_scatter(m, x, from, true);
    return uniform<Real>(rng) * m.survival < reflection.probability ? reflection
                                                                    : dirac_scatter(m, x, from, false);
}

} // namespace bpt
