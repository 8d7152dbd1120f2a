#include "geometry.hpp"

#include <cmath>

namespace check_paths {

namespace {

using mis::not_given;
using mis::recorded_vertex;
using mis::vertex_kind;

double dot(const vec3& a, const vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// From one vertex to the next, for an infinite light its direction.
struct edge {
    std::optional<vec3> vector;
    bool is_infinite = false;
};

std::optional<vec3> difference(const std::optional<vec3>& from, const std::optional<vec3>& to) {
    if (!from || !to)
        return {};
    return vec3{(*to)[0] - (*from)[0], (*to)[1] - (*from)[1], (*to)[2] - (*from)[2]};
}

double squared_length(const edge& e) {
    if (e.is_infinite)
        return 1;
    return e.vector ? dot(*e.vector, *e.vector) : not_given;
}

double cosine(const std::optional<vec3>& normal, const edge& e) {
    if (!normal || !e.vector)
        return not_given;
    const double distance2 = squared_length(e);
    return distance2 == 0 ? 0 : std::abs(dot(*normal, *e.vector)) / std::sqrt(distance2);
}

double cosine_at(const recorded_vertex& x, const site& s, const edge& e) {
    const bool has_no_surface = x.kind == vertex_kind::medium || x.kind == vertex_kind::infinite_light ||
                                (x.kind == vertex_kind::light && !s.normal);
    return has_no_surface ? 1 : cosine(s.normal, e);
}

void set_unless_given(double& field, double value) {
    if (!mis::is_given(field))
        field = value;
}

} // namespace

void measure(mis::path_record& record, const std::vector<vertex_geometry>& geometry) {
    auto& vertices = record.vertices;
    for (std::size_t i = 0; i + 1 < vertices.size(); ++i) {
        recorded_vertex &x = vertices[i], &next = vertices[i + 1];
        const site &from = geometry[i].photon, &to = geometry[i + 1].own;
        const bool is_infinite = next.kind == vertex_kind::infinite_light;
        const auto between = difference(from.position, to.position);
        const edge e{is_infinite ? geometry[i + 1].direction : between, is_infinite};
        set_unless_given(x.distance2_to_light, squared_length(e));
        set_unless_given(x.cos_to_light, cosine_at(x, from, e));
        set_unless_given(next.cos_to_camera, cosine_at(next, to, e));
        set_unless_given(x.shading_cos_to_light, cosine(from.shading_normal, e));
        set_unless_given(next.shading_cos_to_camera, cosine(to.shading_normal, e));
        if (is_infinite && between)
            next.distance2_at_infinity = dot(*between, *between);
    }
}

} // namespace check_paths
