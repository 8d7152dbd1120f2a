// The scenes, as data.
#include "medium.hpp"
#include <array>
#include <map>
#include <stdexcept>

namespace bpt {
namespace {

using dvec3 = glm::dvec3;

// Reflectance of the Cornell box's paints, measured from 400 to 700 nm every 4 nm, as the Cornell University
// Program of Computer Graphics has published it.
constexpr std::array<double, 76> white_paint{
    .343, .445, .551, .624, .665, .687, .708, .723, .715, .710, .745, .758, .739, .767, .777, .765,
    .751, .745, .748, .729, .745, .757, .753, .750, .746, .747, .735, .732, .739, .734, .725, .721,
    .733, .725, .732, .743, .744, .748, .728, .716, .733, .726, .713, .740, .754, .764, .752, .736,
    .734, .741, .740, .732, .745, .755, .751, .744, .731, .733, .744, .731, .712, .708, .729, .730,
    .727, .707, .703, .729, .750, .760, .751, .739, .724, .730, .740, .737};
constexpr std::array<double, 76> green_paint{
    .092, .096, .098, .097, .098, .095, .095, .097, .095, .094, .097, .098, .096, .101, .103, .104,
    .107, .109, .112, .115, .125, .140, .160, .187, .229, .285, .343, .390, .435, .464, .472, .476,
    .481, .462, .447, .441, .426, .406, .373, .347, .337, .314, .285, .277, .266, .250, .230, .207,
    .186, .171, .160, .148, .141, .136, .130, .126, .123, .121, .122, .119, .114, .115, .117, .117,
    .118, .120, .122, .128, .132, .139, .144, .146, .150, .152, .157, .159};
constexpr std::array<double, 76> red_paint{
    .040, .046, .048, .053, .049, .050, .053, .055, .057, .056, .059, .057, .061, .061, .060, .062,
    .062, .062, .061, .062, .060, .059, .057, .058, .058, .058, .056, .055, .056, .059, .057, .055,
    .059, .059, .058, .059, .061, .061, .063, .063, .067, .068, .072, .080, .090, .099, .124, .154,
    .192, .255, .287, .349, .402, .443, .487, .513, .558, .584, .620, .606, .609, .651, .612, .610,
    .650, .638, .627, .620, .630, .628, .642, .639, .657, .639, .635, .642};

// Three bands stand for colours: blue 400 to 500 nm, green 500 to 600, red 600 to 700.
dvec3 in_bands(const std::array<double, 76>& spectrum) {
    dvec3 rgb(0);
    for (std::size_t band = 0; band < 3; ++band) {
        for (std::size_t i = 25 * band; i <= 25 * band + 25; ++i)
            rgb[2 - static_cast<int>(band)] += spectrum[i] / 26;
    }
    return rgb;
}
// The light's published spectrum is 0, 8, 15.6, 18.4 at 400, 500, 600, 700 nm.
const dvec3 cornell_light((15.6 + 18.4) / 2, (8 + 15.6) / 2, (0 + 8) / 2.0);

// Builds a scene in double; cast_to() makes one of another scalar type of it.
struct builder {
    scene<double> s;

    int add(const material<double>& m) {
        s.materials.push_back(m);
        return static_cast<int>(s.materials.size()) - 1;
    }
    int diffuse(const dvec3& albedo) {
        material<double> m;
        m.diffuse = albedo;
        m.survival = std::max({albedo.x, albedo.y, albedo.z, 0.2});
        return add(m);
    }
    int glossy(const dvec3& albedo, const dvec3& specular, double exponent) {
        material<double> m;
        m.kind = material_kind::glossy;
        m.diffuse = albedo;
        m.specular = specular;
        m.exponent = exponent;
        m.survival = std::max({albedo.x + specular.x, albedo.y + specular.y, albedo.z + specular.z});
        return add(m);
    }
    int mirror(double reflectance) {
        material<double> m;
        m.kind = material_kind::mirror;
        m.specular = dvec3(reflectance);
        m.survival = reflectance;
        return add(m);
    }
    int glass(double eta) {
        material<double> m;
        m.kind = material_kind::glass;
        m.specular = dvec3(1);
        m.eta = eta;
        m.survival = 0.95;
        return add(m);
    }

    // Extinction per length; albedo of a collision; mean cosine of the phase function.
    int medium(const dvec3& extinction, const dvec3& albedo, double mean_cosine) {
        bpt::medium<double> m;
        m.extinction = extinction;
        m.phase.kind = material_kind::phase;
        m.phase.diffuse = albedo * extinction;
        m.phase.exponent = mean_cosine;
        m.phase.survival = std::max({albedo.x, albedo.y, albedo.z});
        s.media.push_back(m);
        return static_cast<int>(s.media.size()) - 1;
    }
    // An object of a medium: of glass, or without a surface that could be seen.
    int filled(int material, int medium) {
        s.materials[static_cast<std::size_t>(material)].inside = medium;
        return material;
    }
    int boundary() {
        material<double> m;
        m.kind = material_kind::boundary;
        return add(m);
    }

    void begin_cluster() {
        s.clusters.push_back({dvec3(0), std::numeric_limits<double>::max(), s.triangles.size(), 0});
    }
    void triangle_with(const dvec3& a, const dvec3& b, const dvec3& c, int material, int light,
                       const dvec3& na, const dvec3& nb, const dvec3& nc) {
        triangle<double> t;
        t.a = a, t.ab = b - a, t.ac = c - a;
        t.normal = normalize(cross(t.ab, t.ac));
        t.shading_normals[0] = na, t.shading_normals[1] = nb, t.shading_normals[2] = nc;
        t.material = material;
        t.light = light;
        s.triangles.push_back(t);
        ++s.clusters.back().count;
    }
    void flat_triangle(const dvec3& a, const dvec3& b, const dvec3& c, int material, int light) {
        const dvec3 n = normalize(cross(b - a, c - a));
        triangle_with(a, b, c, material, light, n, n, n);
    }
    // Two triangles: the corners of some published walls do not quite lie in one plane.
    void quad(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d, int material, int light = -1) {
        flat_triangle(a, b, c, material, light);
        flat_triangle(a, c, d, material, light);
    }
    void ball(const dvec3& center, double radius, int material) {
        s.spheres.push_back({center, radius, material});
    }

    // Emits on the side of cross(b - a, d - a).
    void area_light(const dvec3& a, const dvec3& b, const dvec3& d, const dvec3& radiance,
                    double select_emission, double select_next_event) {
        light<double> l;
        l.emission = radiance;
        l.origin = a, l.edge_u = b - a, l.edge_v = d - a;
        l.normal = normalize(cross(l.edge_u, l.edge_v));
        l.area = length(cross(l.edge_u, l.edge_v));
        l.select_emission = select_emission;
        l.select_next_event = select_next_event;
        s.lights.push_back(l);
        quad(a, b, b + d - a, d, 0, static_cast<int>(s.lights.size()) - 1);
    }
    void point_light(const dvec3& position, const dvec3& intensity, double select_emission,
                     double select_next_event) {
        light<double> l;
        l.kind = light_kind::point;
        l.emission = intensity;
        l.origin = position;
        l.select_emission = select_emission;
        l.select_next_event = select_next_event;
        s.lights.push_back(l);
    }
    void environment(const dvec3& zenith, const dvec3& horizon, const dvec3& sun, const dvec3& towards_sun,
                     double exponent, double select_emission, double select_next_event) {
        light<double> l;
        l.kind = light_kind::environment;
        l.emission = zenith, l.horizon = horizon, l.sun = sun;
        l.normal = normalize(towards_sun);
        l.sun_exponent = exponent;
        l.lobe_share_emission = 0.5;
        l.lobe_share_next_event = 0.7;
        l.select_emission = select_emission;
        l.select_next_event = select_next_event;
        s.environment = static_cast<int>(s.lights.size());
        s.lights.push_back(l);
    }
    void look(const dvec3& position, const dvec3& at, double half_extent, double lens_radius = 0,
              double focus_distance = 1) {
        camera<double>& c = s.camera;
        c.position = position;
        c.forward = normalize(at - position);
        c.right = normalize(cross(c.forward, dvec3(0, 1, 0)));
        c.up = cross(c.right, c.forward);
        c.half_extent = half_extent;
        c.lens_radius = lens_radius;
        c.focus_distance = focus_distance;
    }
};

// ---- The Cornell box, by its published coordinates ----

struct box_paints {
    int white, red, green;
};

box_paints cornell_walls(builder& b) {
    const box_paints paint{b.diffuse(in_bands(white_paint)), b.diffuse(in_bands(red_paint)),
                           b.diffuse(in_bands(green_paint))};
    b.begin_cluster();
    b.quad({552.8, 0, 0}, {0, 0, 0}, {0, 0, 559.2}, {549.6, 0, 559.2}, paint.white);               // floor
    b.quad({549.6, 0, 559.2}, {0, 0, 559.2}, {0, 548.8, 559.2}, {556, 548.8, 559.2}, paint.white); // back
    b.quad({0, 0, 559.2}, {0, 0, 0}, {0, 548.8, 0}, {0, 548.8, 559.2}, paint.green);               // right
    b.quad({552.8, 0, 0}, {549.6, 0, 559.2}, {556, 548.8, 559.2}, {556, 548.8, 0}, paint.red);     // left
    // The ceiling, around the hole in which the light hangs.
    b.quad({556, 548.8, 0}, {556, 548.8, 227}, {0, 548.8, 227}, {0, 548.8, 0}, paint.white);
    b.quad({556, 548.8, 332}, {556, 548.8, 559.2}, {0, 548.8, 559.2}, {0, 548.8, 332}, paint.white);
    b.quad({556, 548.8, 227}, {556, 548.8, 332}, {343, 548.8, 332}, {343, 548.8, 227}, paint.white);
    b.quad({213, 548.8, 227}, {213, 548.8, 332}, {0, 548.8, 332}, {0, 548.8, 227}, paint.white);
    b.look({278, 273, -800}, {278, 273, 0}, 0.0125 / 0.035);
    b.s.center = {278, 274, 279.6};
    b.s.radius = 485;
    b.s.exposure = 1.6;
    return paint;
}
void ceiling_light(builder& b, double select_emission = 1, double select_next_event = 1) {
    b.area_light({343, 548.8, 227}, {343, 548.8, 332}, {213, 548.8, 227}, cornell_light, select_emission,
                 select_next_event);
}
void short_block(builder& b, int material) {
    b.quad({130, 165, 65}, {82, 165, 225}, {240, 165, 272}, {290, 165, 114}, material);
    b.quad({290, 0, 114}, {290, 165, 114}, {240, 165, 272}, {240, 0, 272}, material);
    b.quad({130, 0, 65}, {130, 165, 65}, {290, 165, 114}, {290, 0, 114}, material);
    b.quad({82, 0, 225}, {82, 165, 225}, {130, 165, 65}, {130, 0, 65}, material);
    b.quad({240, 0, 272}, {240, 165, 272}, {82, 165, 225}, {82, 0, 225}, material);
}
void tall_block(builder& b, int material) {
    b.quad({423, 330, 247}, {265, 330, 296}, {314, 330, 456}, {472, 330, 406}, material);
    b.quad({423, 0, 247}, {423, 330, 247}, {472, 330, 406}, {472, 0, 406}, material);
    b.quad({472, 0, 406}, {472, 330, 406}, {314, 330, 456}, {314, 0, 456}, material);
    b.quad({314, 0, 456}, {314, 330, 456}, {265, 330, 296}, {265, 0, 296}, material);
    b.quad({265, 0, 296}, {265, 330, 296}, {423, 330, 247}, {423, 0, 247}, material);
}

// Stands on the floor without a face of its own there, so that paths from the floor are refracted once where
// it is of glass.
void block(builder& b, const dvec3& low, const dvec3& high, int material) {
    b.begin_cluster();
    const auto corner = [&](int x, int y, int z) {
        return dvec3(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z);
    };
    b.quad(corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0), material);
    b.quad(corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0), material);
    b.quad(corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1), material);
    b.quad(corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0), material);
    b.quad(corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1), material);
}

// With a face there.
void closed_block(builder& b, const dvec3& low, const dvec3& high, int material) {
    block(b, low, high, material);
    b.quad(low, {high.x, low.y, low.z}, {high.x, low.y, high.z}, {low.x, low.y, high.z}, material);
}

void cornell(builder& b) {
    const auto paint = cornell_walls(b);
    ceiling_light(b);
    short_block(b, paint.white);
    tall_block(b, paint.white);
}

void spheres(builder& b) {
    cornell_walls(b);
    ceiling_light(b);
    b.ball({390, 100, 370}, 100, b.mirror(0.9));
    b.ball({180, 100, 180}, 100, b.glass(1.5));
}

void glossy(builder& b) {
    cornell_walls(b);
    ceiling_light(b);
    const int metal = b.glossy(dvec3(0.05), dvec3(0.75, 0.7, 0.6), 40);
    const int plastic = b.glossy(dvec3(0.2, 0.3, 0.5), dvec3(0.3), 15);
    short_block(b, plastic);
    tall_block(b, metal);
}

// The box seen from above, so that its light is out of sight: an image's noise is then not that of the
// light's own pixels.
void look_down(builder& b) {
    b.look({278, 300, -500}, {278, 140, 280}, 0.42);
    b.s.exposure = 4;
}

// A square light under the ceiling, as bright as the published one in all, in place of the hole.
void small_light(builder& b, int ceiling, double half) {
    b.quad({343, 548.8, 227}, {343, 548.8, 332}, {213, 548.8, 332}, {213, 548.8, 227}, ceiling);
    const double as_much_as_the_published_light = 130 * 105 / (4 * half * half);
    b.area_light({278 + half, 548, 280 - half}, {278 + half, 548, 280 + half}, {278 - half, 548, 280 - half},
                 cornell_light * as_much_as_the_published_light, 1, 1);
}

// A small light, a block of glass and a glossy one: light that the glass has gathered is seen through the
// glass. After [H] figure 13.
void caustic(builder& b) {
    const auto paint = cornell_walls(b);
    small_light(b, paint.white, 20);
    tall_block(b, b.glossy(dvec3(0.05), dvec3(0.75, 0.7, 0.6), 1000));
    block(b, {80, 0, 60}, {250, 165, 230}, b.glass(1.5));
    look_down(b);
}

// Nothing but diffuse surfaces and a large light, as in [H] figure 12.
void diffuse(builder& b) {
    cornell(b);
    look_down(b);
}

// The box with a floor that reflects all around in a narrow lobe, and everything else diffuse.
void glossy_floor(builder& b) {
    cornell(b);
    const int polished = b.glossy(dvec3(0.15), dvec3(0.6), 30);
    b.s.triangles[0].material = b.s.triangles[1].material = polished;
}

// A floor under a clear liquid, lit by four points above it: all light is refracted on its way to the floor
// and on its way to the camera, so that only merges find it. Next to nothing is reflected and no walk is
// ended, so that merges are all that is noisy. [H] figure 7 has a torus in glass.
void pool(builder& b) {
    b.begin_cluster();
    b.quad({-9, 0, -9}, {-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, b.diffuse(dvec3(0.7)));
    b.quad({-20, 0.3, -20}, {-20, 0.3, 20}, {20, 0.3, 20}, {20, 0.3, -20}, b.glass(1.1));
    for (auto& m : b.s.materials)
        m.survival = 1;
    for (int k = 0; k < 4; ++k)
        b.point_light({k % 2 ? 0.8 : -0.8, 1.3, k / 2 ? 0.8 : -0.8}, dvec3(2), 0.25, 0.25);
    b.look({0, 5, -3}, {0, 0, 0}, 0.26);
    b.s.center = {0, 0.5, 0};
    b.s.radius = 15;
    b.s.exposure = 1;
}

// Nine rooms without ceilings, seen from above, under many lamps of one color: sixteen weak ones of similar
// strength in every room, and in every second room a cluster of six strong ones and a table. The lamps hang
// below the tops of the walls, so that none lights another room.
void rooms(builder& b) {
    const int white = b.diffuse(in_bands(white_paint)), red = b.diffuse(in_bands(red_paint)),
              green = b.diffuse(in_bands(green_paint)), wood = b.diffuse(dvec3(0.4));
    constexpr double half = 6, height = 3.2, lamps = 3;
    b.begin_cluster();
    b.quad({-half, 0, -half}, {-half, 0, half}, {half, 0, half}, {half, 0, -half}, white);
    for (int k = 0; k <= 3; ++k) {
        const double at = 4 * k - half;
        b.quad({at, 0, -half}, {at, 0, half}, {at, height, half}, {at, height, -half}, k % 2 ? green : white);
        b.quad({-half, 0, at}, {half, 0, at}, {half, height, at}, {-half, height, at}, k % 2 ? red : white);
    }
    const dvec3 warm(1, 0.9, 0.7);
    for (int room = 0; room < 9; ++room) {
        const dvec3 center(4 * (room % 3) - 4, 0, 4 * (room / 3) - 4);
        for (int i = 0; i < 16; ++i)
            b.point_light(center + dvec3(0.8 * (i % 4) - 1.2, lamps, 0.8 * (i / 4) - 1.2),
                          (1.4 + 0.08 * (i * 7 % 16)) * warm, 1, 1);
        if (room % 2)
            continue;
        const dvec3 aside(std::cos(2.4 * room), 0, std::sin(2.4 * room)), table = center + 0.8 * aside;
        block(b, table - dvec3(0.5, 0, 0.35), table + dvec3(0.5, 0.5, 0.35), wood);
        for (int i = 0; i < 6; ++i)
            b.point_light(center - 0.5 * aside + dvec3(0.15 * (i % 3), lamps, 0.15 * (i / 3)), 6.0 * warm, 1,
                          1);
    }
    for (auto& l : b.s.lights)
        l.select_emission = l.select_next_event = 1 / static_cast<double>(b.s.lights.size());
    b.look({0, 22, -8}, {0, 0.3, 0}, 0.235);
    b.s.center = {0, 1.6, 0};
    b.s.radius = 9;
    b.s.exposure = 0.4;
}

// Two white rooms, and between them a door that is nearly closed. A lamp in the far one lights its ceiling:
// whatever is seen in the near one has come through the gap after two bounces and more.
void door(builder& b) {
    const int white = b.diffuse({0.85, 0.85, 0.83}), floor = b.diffuse({0.7, 0.6, 0.5}),
              wood = b.diffuse({0.55, 0.4, 0.3}), blue = b.diffuse({0.3, 0.45, 0.7});
    constexpr double half = 4, height = 2.6, depth = 5, hinge = 3, wide = 1, high = 2.1;
    b.begin_cluster();
    b.quad({-half, 0, 0}, {-half, 0, depth}, {half, 0, depth}, {half, 0, 0}, floor);
    b.quad({-half, height, 0}, {-half, height, depth}, {half, height, depth}, {half, height, 0}, white);
    b.quad({-half, 0, 0}, {half, 0, 0}, {half, height, 0}, {-half, height, 0}, white);
    b.quad({-half, 0, depth}, {half, 0, depth}, {half, height, depth}, {-half, height, depth}, white);
    for (const double x : {-half, half})
        b.quad({x, 0, 0}, {x, 0, depth}, {x, height, depth}, {x, height, 0}, white);
    // The wall between the rooms, around the doorway; and the door, open by a few degrees.
    b.quad({0, 0, 0}, {0, 0, hinge}, {0, height, hinge}, {0, height, 0}, white);
    b.quad({0, 0, hinge + wide}, {0, 0, depth}, {0, height, depth}, {0, height, hinge + wide}, white);
    b.quad({0, high, hinge}, {0, high, hinge + wide}, {0, height, hinge + wide}, {0, height, hinge}, white);
    constexpr double angle = 0.15;
    const dvec3 leaf(-std::sin(angle) * wide, 0, std::cos(angle) * wide), at(0, 0, hinge), up(0, high, 0);
    b.quad(at, at + leaf, at + leaf + up, at + up, wood);
    block(b, {-2.4, 0, 3.2}, {-1.4, 0.8, 4.2}, blue);
    block(b, {-0.9, 0, 1.2}, {-0.3, 1.2, 1.8}, white);
    // The lamp closes the box that it stands on, so that nothing sees it from behind.
    const dvec3 lamp(2.8, 1.8, 0.8), along_z(0, 0, 0.6), along_x(0.6, 0, 0), down(0, -1.8, 0);
    b.area_light(lamp, lamp + along_z, lamp + along_x, {300, 270, 220}, 1, 1);
    for (const dvec3& side : {along_x, along_z}) {
        const dvec3 across = along_x + along_z - side;
        for (const dvec3& from : {lamp, lamp + across})
            b.quad(from, from + side, from + side + down, from + down, wood);
    }
    b.look({-3.7, 1.7, 0.4}, {-0.6, 0.9, 3.4}, 0.65);
    b.s.center = {0, height / 2, depth / 2};
    b.s.radius = 4.9;
    b.s.exposure = 6;
}

// A small lamp and a small plate, nearly a mirror: all that is bright is seen in a few pixels.
void glint(builder& b) {
    const auto paint = cornell_walls(b);
    small_light(b, paint.white, 12);
    tall_block(b, paint.white);
    block(b, {150, 0, 120}, {230, 40, 200}, b.glossy(dvec3(0.05), dvec3(0.85), 400));
    look_down(b);
}

// Two closed white rooms and a doorway. The lamp hangs in the one, where it is not seen from the other, in
// which the camera stands: of many light vertices few are joined to what it sees.
void doorway(builder& b) {
    const int white = b.diffuse(dvec3(0.9)), floor = b.diffuse({0.65, 0.55, 0.45}),
              blue = b.diffuse({0.3, 0.45, 0.75}), red = b.diffuse({0.75, 0.25, 0.2});
    constexpr double length = 4, width = 4, height = 2.8, left = 1.5, right = 2.0, top = 2.1;
    b.begin_cluster();
    b.quad({-length, 0, 0}, {length, 0, 0}, {length, 0, width}, {-length, 0, width}, floor);
    b.quad({-length, height, 0}, {length, height, 0}, {length, height, width}, {-length, height, width},
           white);
    b.quad({-length, 0, 0}, {length, 0, 0}, {length, height, 0}, {-length, height, 0}, white);
    b.quad({-length, 0, width}, {length, 0, width}, {length, height, width}, {-length, height, width}, white);
    b.quad({-length, 0, 0}, {-length, 0, width}, {-length, height, width}, {-length, height, 0}, blue);
    b.quad({length, 0, 0}, {length, 0, width}, {length, height, width}, {length, height, 0}, white);
    // The wall between, around the doorway.
    b.quad({0, 0, 0}, {0, 0, left}, {0, height, left}, {0, height, 0}, white);
    b.quad({0, 0, right}, {0, 0, width}, {0, height, width}, {0, height, right}, white);
    b.quad({0, top, left}, {0, top, right}, {0, height, right}, {0, height, left}, white);
    constexpr double half = 0.25, lamp_x = -2.6, lamp_y = 2.75, lamp_z = 3.2;
    b.area_light({lamp_x + half, lamp_y, lamp_z - half}, {lamp_x + half, lamp_y, lamp_z + half},
                 {lamp_x - half, lamp_y, lamp_z - half}, dvec3(60, 55, 45), 1, 1);
    block(b, {0.5, 0, 2.9}, {1.3, 0.8, 3.7}, red);
    b.ball({1.7, 0.45, 1.9}, 0.45, b.glossy(dvec3(0.2), dvec3(0.6), 30));
    b.look({3.8, 1.6, 0.3}, {0.6, 1, 2.4}, 0.6);
    b.s.center = {0, 1.4, 2};
    b.s.radius = 4.8;
    b.s.exposure = 4;
}

// A coarse sphere of 80 triangles whose shading normals are those of the fine one: 15 degrees apart in
// places.
void smooth_ball(builder& b, const dvec3& center, double radius, int material) {
    const double g = (1 + std::sqrt(5.0)) / 2;
    const std::array<dvec3, 12> corner{dvec3(-1, g, 0), dvec3(1, g, 0), dvec3(-1, -g, 0), dvec3(1, -g, 0),
                                       dvec3(0, -1, g), dvec3(0, 1, g), dvec3(0, -1, -g), dvec3(0, 1, -g),
                                       dvec3(g, 0, -1), dvec3(g, 0, 1), dvec3(-g, 0, -1), dvec3(-g, 0, 1)};
    constexpr std::size_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                          {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                          {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                          {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    b.begin_cluster();
    b.s.clusters.back().center = center;
    b.s.clusters.back().radius = radius * 1.001;
    const auto add = [&](const dvec3& p, const dvec3& q, const dvec3& r) {
        b.triangle_with(center + radius * p, center + radius * q, center + radius * r, material, -1, p, q, r);
    };
    for (const auto& face : faces) {
        const dvec3 p = normalize(corner[face[0]]), q = normalize(corner[face[1]]),
                    r = normalize(corner[face[2]]);
        const dvec3 pq = normalize(p + q), qr = normalize(q + r), rp = normalize(r + p);
        add(p, pq, rp);
        add(pq, q, qr);
        add(rp, qr, r);
        add(pq, qr, rp);
    }
}

void smooth(builder& b) {
    const auto paint = cornell_walls(b);
    ceiling_light(b);
    smooth_ball(b, {380, 120, 370}, 120, paint.white);
    smooth_ball(b, {180, 110, 180}, 110, b.glossy(dvec3(0.4, 0.25, 0.1), dvec3(0.3), 12));
}

void environment(builder& b) {
    const int ground = b.diffuse({0.5, 0.45, 0.4});
    b.begin_cluster();
    b.quad({-6, 0, -6}, {-6, 0, 6}, {6, 0, 6}, {6, 0, -6}, ground);
    b.ball({-1.1, 1, 0.6}, 1, b.mirror(0.9));
    b.ball({1.2, 0.8, -0.6}, 0.8, b.glass(1.5));
    b.ball({0.2, 0.5, -1.6}, 0.5, b.diffuse({0.7, 0.25, 0.2}));
    b.environment({0.35, 0.55, 0.9}, {0.6, 0.55, 0.5}, {6, 5, 3.5}, {-0.5, 0.6, -0.4}, 60, 1, 1);
    b.look({0, 2.2, -7}, {0, 0.7, 0}, 0.45);
    b.s.center = {0, 0.5, 0};
    b.s.radius = 9;
    b.s.exposure = 0.8;
}

void point(builder& b) {
    const auto paint = cornell_walls(b);
    b.quad({343, 548.8, 227}, {343, 548.8, 332}, {213, 548.8, 332}, {213, 548.8, 227},
           paint.white); // no hole
    short_block(b, b.glossy(dvec3(0.3, 0.3, 0.4), dvec3(0.4), 20));
    b.ball({380, 110, 360}, 110, b.mirror(0.9));
    b.point_light({278, 430, 220}, 60000.0 * cornell_light / 17.0, 1, 1);
}

void lens(builder& b) {
    const auto paint = cornell_walls(b);
    ceiling_light(b, 0.5, 0.25);
    short_block(b, b.glossy(dvec3(0.2, 0.25, 0.3), dvec3(0.4), 25));
    tall_block(b, paint.white);
    b.ball({440, 70, 130}, 70, b.mirror(0.9));
    b.point_light({100, 400, 300}, {9000, 12000, 20000}, 0.2, 0.45);
    b.environment({0.3, 0.4, 0.6}, {0.3, 0.3, 0.3}, {3, 2, 1}, {0.3, 0.5, -1}, 30, 0.3, 0.3);
    b.look({278, 273, -800}, {278, 273, 0}, 0.0125 / 0.035, 25, 930);
    b.s.exposure = 0.8;
}

// Everything in one place: every kind of vertex and of light, and lights picked with other probabilities by
// each walk. Walks leave one block uniformly; with two light samples, the environment is then as likely to be
// hit as to be picked, 0.25 / (2 pi) = 2 0.25 / (4 pi), and the maximum heuristic meets a tie.
// Every second of 4 x 4 tiles of the back wall, in another paint.
void tiles(builder& b, int material) {
    constexpr double size = 548.8 / 4, z = 559;
    for (int row = 0; row < 4; ++row)
        for (int column = row % 2; column < 4; column += 2) {
            const double x = column * size, y = row * size;
            b.quad({x + size, y, z}, {x, y, z}, {x, y + size, z}, {x + size, y + size, z}, material);
        }
}

void mixed(builder& b) {
    const auto paint = cornell_walls(b);
    tiles(b, paint.green);
    ceiling_light(b, 0.5, 0.45);
    tall_block(b, b.glossy(dvec3(0), dvec3(0.25), 0));
    short_block(b, b.glossy(dvec3(0.2, 0.3, 0.5), dvec3(0.3), 15));
    smooth_ball(b, {368, 405, 351}, 75, b.glossy(dvec3(0.4, 0.25, 0.1), dvec3(0.3), 12));
    b.ball({186, 225, 168}, 60, b.mirror(0.9));
    block(b, {330, 0, 40}, {510, 90, 220}, b.glass(1.5));
    b.point_light({100, 400, 300}, {9000, 12000, 20000}, 0.2, 0.3);
    const dvec3 sky(0.3, 0.4, 0.6);
    b.environment(sky, sky, dvec3(0), {0, 0, -1}, 1, 0.3, 0.25);
    b.s.lights.back().lobe_share_emission = b.s.lights.back().lobe_share_next_event = 0;
}

// ---- Media ----

// A lamp in a housing that glass closes, so that all of its light has passed the glass, and no next event
// finds it.
void lamp_behind_glass(builder& b, double lamp, double tube, double emission, int ceiling) {
    b.quad({343, 548.8, 227}, {343, 548.8, 332}, {213, 548.8, 332}, {213, 548.8, 227}, ceiling); // no hole
    constexpr double low = 500, thick = 5;
    const dvec3 at(278, 548, 280);
    b.area_light(at + dvec3(lamp, 0, -lamp), at + dvec3(lamp, 0, lamp), at + dvec3(-lamp, 0, -lamp),
                 cornell_light * emission, 1, 1);
    const int black = b.diffuse(dvec3(0.02)), glass = b.glass(1.5);
    b.begin_cluster();
    const auto corner = [&](double x, double y, double z) {
        return dvec3(at.x + x * tube, y, at.z + z * tube);
    };
    for (const auto& side : {dvec3(1, 0, 0), dvec3(-1, 0, 0), dvec3(0, 0, 1), dvec3(0, 0, -1)}) {
        const dvec3 along(side.z, 0, side.x), p = side + along, q = side - along;
        b.quad(corner(p.x, low, p.z), corner(q.x, low, q.z), corner(q.x, 549, q.z), corner(p.x, 549, p.z),
               black);
    }
    closed_block(b, corner(-1.1, low - thick, -1.1), corner(1.1, low, 1.1), glass);
}

// A spot light in fog.
void fog(builder& b) {
    const auto paint = cornell_walls(b);
    lamp_behind_glass(b, 10, 30, 150, paint.white);
    short_block(b, paint.white);
    b.s.medium = b.medium(dvec3(0.0012), dvec3(0.9), 0.3);
}

// A ball of a red liquid on the floor, and the caustic below it.
void liquid(builder& b) {
    cornell_walls(b);
    ceiling_light(b);
    const int red = b.medium(dvec3(0.002, 0.012, 0.02), dvec3(0.8, 0.3, 0.2), 0.0);
    b.ball({278, 130, 250}, 120, b.filled(b.glass(1.33), red));
}

// A thick milky ball without a surface, and one of glass.
void milk(builder& b) {
    cornell_walls(b);
    ceiling_light(b);
    const int milk = b.medium(dvec3(0.05, 0.06, 0.08), dvec3(0.99, 0.97, 0.93), 0.6);
    b.ball({390, 120, 370}, 110, b.filled(b.boundary(), milk));
    b.ball({170, 110, 190}, 100, b.filled(b.glass(1.3), milk));
}

// A spot light on a dark stage, in a haze so thin that few paths collide twice, seen through a window: light
// that is scattered once has passed glass at both ends, so that no connection finds it.
void haze(builder& b) {
    cornell_walls(b);
    for (auto& wall : b.s.materials) {
        wall.diffuse = dvec3(0.03);
        wall.survival = 0.03;
    }
    lamp_behind_glass(b, 5, 13, 8000, 0);
    closed_block(b, {-5, -5, -12}, {561, 554, -4}, b.glass(1.5));
    b.s.radius = 495;
    b.s.medium = b.medium(dvec3(0.0004, 0.0006, 0.001), dvec3(0.95), 0.7);
}

const std::map<std::string, void (*)(builder&)>& builders() {
    static const std::map<std::string, void (*)(builder&)> all{{"cornell", cornell},
                                                               {"spheres", spheres},
                                                               {"glossy", glossy},
                                                               {"smooth", smooth},
                                                               {"environment", environment},
                                                               {"point", point},
                                                               {"lens", lens},
                                                               {"mixed", mixed},
                                                               {"caustic", caustic},
                                                               {"diffuse", diffuse},
                                                               {"glossy_floor", glossy_floor},
                                                               {"pool", pool},
                                                               {"rooms", rooms},
                                                               {"door", door},
                                                               {"glint", glint},
                                                               {"doorway", doorway},
                                                               {"fog", fog},
                                                               {"liquid", liquid},
                                                               {"milk", milk},
                                                               {"haze", haze}};
    return all;
}

template <class Real> scene<Real> cast_to(const scene<double>& d) {
    using v = vec3<Real>;
    const auto r = [](double x) { return static_cast<Real>(x); };
    scene<Real> s;
    s.name = d.name;
    const auto cast_material = [&](const material<double>& m) {
        return material<Real>{m.kind,   v(m.diffuse),  v(m.specular), r(m.exponent),
                              r(m.eta), r(m.survival), m.inside};
    };
    for (const auto& m : d.materials)
        s.materials.push_back(cast_material(m));
    for (const auto& m : d.media)
        s.media.push_back({v(m.extinction), cast_material(m.phase)});
    s.medium = d.medium;
    for (const auto& t : d.triangles)
        s.triangles.push_back({v(t.a),
                               v(t.ab),
                               v(t.ac),
                               v(t.normal),
                               {v(t.shading_normals[0]), v(t.shading_normals[1]), v(t.shading_normals[2])},
                               t.material,
                               t.light});
    for (const auto& c : d.clusters) {
        const bool unbounded = c.radius == std::numeric_limits<double>::max();
        s.clusters.push_back(
            {v(c.center), unbounded ? std::numeric_limits<Real>::max() : r(c.radius), c.first, c.count});
    }
    for (const auto& b : d.spheres)
        s.spheres.push_back({v(b.center), r(b.radius), b.material});
    for (const auto& l : d.lights)
        s.lights.push_back({l.kind, r(l.select_emission), r(l.select_next_event), v(l.emission), v(l.origin),
                            v(l.edge_u), v(l.edge_v), v(l.normal), r(l.area), v(l.horizon), v(l.sun),
                            r(l.sun_exponent), r(l.lobe_share_emission), r(l.lobe_share_next_event)});
    s.environment = d.environment;
    const auto& c = d.camera;
    s.camera = {v(c.position),    v(c.forward),     v(c.right),         v(c.up),
                r(c.half_extent), r(c.lens_radius), r(c.focus_distance)};
    s.center = v(d.center);
    s.radius = r(d.radius);
    s.exposure = r(d.exposure);
    return s;
}

} // namespace

const std::vector<std::string>& scene_names() {
    static const std::vector<std::string> names{"cornell",     "spheres", "glossy", "smooth",
                                                "environment", "point",   "lens",   "mixed"};
    return names;
}

const std::vector<std::string>& study_scene_names() {
    static const std::vector<std::string> names{"caustic", "diffuse", "glossy_floor", "pool",
                                                "rooms",   "door",    "glint",        "doorway"};
    return names;
}

const std::vector<std::string>& media_scene_names() {
    static const std::vector<std::string> names{"fog", "liquid", "milk", "haze"};
    return names;
}

std::vector<std::string> all_scene_names() {
    std::vector<std::string> names = scene_names();
    for (const auto* more : {&study_scene_names(), &media_scene_names()})
        names.insert(names.end(), more->begin(), more->end());
    return names;
}

template <class Real> scene<Real> make_scene(const std::string& name) {
    const auto found = builders().find(name);
    if (found == builders().end())
        throw std::runtime_error("unknown scene '" + name + "'");
    builder b;
    b.s.name = name;
    b.diffuse(dvec3(0)); // material 0, of lights
    found->second(b);
    return cast_to<Real>(b.s);
}

template <class Real> scene<Real> scaled(scene<Real> s, Real factor) {
    for (auto& t : s.triangles)
        t.a *= factor, t.ab *= factor, t.ac *= factor;
    for (auto& c : s.clusters) {
        c.center *= factor;
        if (c.radius != std::numeric_limits<Real>::max())
            c.radius *= factor;
    }
    for (auto& b : s.spheres)
        b.center *= factor, b.radius *= factor;
    for (auto& l : s.lights) {
        l.origin *= factor, l.edge_u *= factor, l.edge_v *= factor;
        l.area *= factor * factor;
        if (l.kind == light_kind::point)
            l.emission *= factor * factor;
    }
    for (auto& m : s.media)
        m.extinction /= factor, m.phase.diffuse /= factor;
    s.camera.position *= factor;
    s.camera.lens_radius *= factor;
    s.camera.focus_distance *= factor;
    s.center *= factor;
    s.radius *= factor;
    return s;
}

template scene<float> scaled(scene<float>, float);
template scene<double> scaled(scene<double>, double);
template scene<float> make_scene(const std::string&);
template scene<double> make_scene(const std::string&);

} // namespace bpt
