// Merging in media: points and beams of the light walks with points and beams of a camera walk.
#pragma once

#include "box_tree.hpp"
#include "merge.hpp"
#include <tools/parallel.hpp>

namespace bpt {

using tools::in_parallel;

// What some light walks leave: photons on surfaces and in media, and beams. The walks themselves where that
// is asked for: to trace them anew takes less memory, but in media it takes time.
template <class Real> struct left_by_light {
    std::vector<photon<Real>> photons, in_media;
    std::vector<beam<Real>> beams;
    std::vector<walk<Real>> walks;
};
template <class Real>
void add_left(const walk<Real>& walk, std::size_t number, const roulette<Real>& roulette,
              left_by_light<Real>& left) {
    add_photons(walk, number, left.photons, false, roulette);
    add_photons(walk, number, left.in_media, true, roulette);
    for (beam<Real> b : walk.beams) {
        b.walk = static_cast<std::uint32_t>(number);
        left.beams.push_back(b);
    }
}

// What all light walks of a pass leave, row by row.
template <class Renderer> auto trace_all_light_walks(const Renderer& renderer, int pass) {
    using Real = typename Renderer::scalar;
    const auto width = static_cast<std::size_t>(renderer.set.width);
    std::vector<left_by_light<Real>> rows(width);
    in_parallel(renderer.set.threads, renderer.set.width, [&](int row) {
        const std::size_t first = static_cast<std::size_t>(row) * width;
        walk<Real> light;
        for (std::size_t pixel = first; pixel < first + width; ++pixel) {
            renderer.trace_light_walk(pass, pixel, light);
            auto& left = rows[static_cast<std::size_t>(row)];
            add_left(light, pixel, renderer.weigh.roulette, left);
            if (has_media(renderer.scene) && renderer.connects_light_walks()) {
                light.beams.clear(); // which are not connected
                left.walks.push_back(light);
            }
        }
    });
    return rows;
}

// One after the other.
template <class Real, class T>
std::vector<T> concatenated(std::vector<left_by_light<Real>>& rows,
                            std::vector<T> left_by_light<Real>::*which) {
    std::size_t count = 0;
    for (const auto& row : rows)
        count += (row.*which).size();
    std::vector<T> all;
    all.reserve(count);
    for (auto& row : rows) {
        all.insert(all.end(), std::make_move_iterator((row.*which).begin()),
                   std::make_move_iterator((row.*which).end()));
        row.*which = {};
    }
    return all;
}

// All that a pass' light walks have left in media.
template <class Real> struct media_map {
    photon_map<Real> points;
    std::vector<beam<Real>> beams;
    std::vector<walk<Real>> walks; // all, where they are connected
    std::vector<std::uint32_t> beam_of_piece;
    box_tree points_by_box, pieces_by_box; // as far as the radii reach

    // A box about all of a long beam would be passed by nearly every line. So pieces of beams have boxes: of
    // this length, longer where the beam is far from where it started.
    media_map(std::vector<photon<Real>> photons, std::vector<beam<Real>> light_beams,
              std::vector<walk<Real>> light_walks, const media_merges<Real>& merges, Real piece);

    // The beams that may be near a piece of a line, or a point, each once.
    void find_beams_along(const beam<Real>& line, std::vector<std::uint32_t>& found) const;
    void find_beams_around(const vec3<Real>& point, std::vector<std::uint32_t>& found) const;
};

template <class Real> box box_around(const vec3<Real>& a, const vec3<Real>& b, Real radius) {
    return {glm::vec3(min(a, b) - radius), glm::vec3(max(a, b) + radius)};
}
template <class Real> vec3<Real> point_of(const beam<Real>& b, Real distance) {
    return b.leaving.origin + distance * b.leaving.to;
}

template <class Real>
void find_along(const box_tree& tree, const beam<Real>& line, std::vector<std::uint32_t>& found) {
    tree.find_along(glm::vec3(line.leaving.origin), glm::vec3(line.leaving.to),
                    static_cast<float>(line.begin), static_cast<float>(line.end), found);
}
inline void to_beams(const std::vector<std::uint32_t>& beam_of_piece, std::vector<std::uint32_t>& found) {
    for (auto& i : found)
        i = beam_of_piece[i];
    found.erase(std::unique(found.begin(), found.end()), found.end());
}

template <class Real>
media_map<Real>::media_map(std::vector<photon<Real>> photons, std::vector<beam<Real>> light_beams,
                           std::vector<walk<Real>> light_walks, const media_merges<Real>& merges, Real piece)
    : points(std::move(photons)), beams(std::move(light_beams)), walks(std::move(light_walks)),
      points_by_box([&] {
          std::vector<box> boxes;
          for (const auto& p : points.photons)
              if (merges.sizes.point_beam > Real(0))
                  boxes.push_back(box_around(p.position, p.position, merges.radii.point_beam));
          return boxes;
      }()),
      pieces_by_box([&] {
          const Real radius = std::max(merges.radii.beam_point, merges.radii.beam_beam);
          std::vector<box> boxes;
          for (std::size_t i = 0; i < beams.size(); ++i) {
              const auto& b = beams[i];
              for (Real from = b.begin, to = from; from < b.end; from = to) {
                  to = std::min(b.end, from + std::max(piece, from / 8));
                  boxes.push_back(box_around(point_of(b, from), point_of(b, to), radius));
                  beam_of_piece.push_back(static_cast<std::uint32_t>(i));
              }
          }
          return boxes;
      }()) {}

template <class Real>
void media_map<Real>::find_beams_along(const beam<Real>& line, std::vector<std::uint32_t>& found) const {
    find_along(pieces_by_box, line, found);
    to_beams(beam_of_piece, found);
}
template <class Real>
void media_map<Real>::find_beams_around(const vec3<Real>& point, std::vector<std::uint32_t>& found) const {
    pieces_by_box.find_around(glm::vec3(point), found);
    to_beams(beam_of_piece, found);
}

// Those on surfaces, of all light walks of a pass.
template <class Renderer> auto trace_photons(const Renderer& renderer, int pass) {
    auto rows = trace_all_light_walks(renderer, pass);
    return concatenated(rows, &left_by_light<typename Renderer::scalar>::photons);
}

template <class Real>
std::shared_ptr<const media_map<Real>> make_media_map(std::vector<left_by_light<Real>>& left,
                                                      const media_merges<Real>& merges, Real scene_radius) {
    return std::make_shared<const media_map<Real>>(
        concatenated(left, &left_by_light<Real>::in_media), concatenated(left, &left_by_light<Real>::beams),
        concatenated(left, &left_by_light<Real>::walks), merges, scene_radius / 16);
}

// ---- Which are near: the kernels' domains ----

// The distance along a beam at which a point is beside it, if it is within the radius.
template <class Real> std::optional<Real> beside(const beam<Real>& b, const vec3<Real>& point, Real radius) {
    const Real along = dot(point - b.leaving.origin, b.leaving.to);
    const vec3<Real> apart = point - point_of(b, along);
    const bool is_near = along > b.begin && along < b.end && dot(apart, apart) < radius * radius;
    return is_near ? std::optional(along) : std::nullopt;
}

// The distances along two beams at which they are nearest to each other, if they are within the radius there.
template <class Real>
std::optional<std::pair<Real, Real>> across(const beam<Real>& a, const beam<Real>& b, Real radius) {
    const vec3<Real> normal = cross(a.leaving.to, b.leaving.to), apart = b.leaving.origin - a.leaving.origin;
    const Real sine2 = dot(normal, normal), between = dot(apart, normal);
    if (sine2 == Real(0) || between * between >= radius * radius * sine2)
        return std::nullopt;
    const Real on_a = dot(cross(apart, b.leaving.to), normal) / sine2,
               on_b = dot(cross(apart, a.leaving.to), normal) / sine2;
    const bool both = on_a > a.begin && on_a < a.end && on_b > b.begin && on_b < b.end;
    return both ? std::optional(std::pair(on_a, on_b)) : std::nullopt;
}

// ---- Merges ----

// A camera walk's vertex, x_{s-1}, real or on a beam, merged with a light walk's. All sizes at this place are
// in the weight; this family's is the number of samples.
template <class Real, class Weights, class Sink>
void merge_in_medium(const sample_pair<Real, Weights>& pair, mis::merge_family family, const vertex<Real>& x,
                     const photon<Real>& photon, Sink&& sink) {
    const auto& weigh = pair.weigh;
    const int s = x.depth, t = photon.vertices - 1;
    const vec3<Real>& across = photon.towards_previous;
    const auto here = sizes_at(weigh.media.sizes, walk_kind::from_camera, x, across, photon.beam);
    const Real samples = mis::size_of(here, family);
    if (photon.medium != x.medium || s + t > pair.longest || !(samples > Real(0)))
        return;
    const color<Real> f = evaluate(*x.material, x.point, x.towards_previous, across);
    const color<Real> value = x.throughput * f * photon.throughput / samples;
    const Real weight =
        weigh.merge(x.state, photon.state, merge_density_to_light(x, across, weigh.roulette),
                    merge_density_to_camera(x, across, photon.survival), joined(weigh.heuristic, here)) *
        mis::family_share(weigh.heuristic, here, family);
    sink({{mis::technique_kind::merge, s}, s + t, pair.pixel, value, weight, family},
         {&x, s, nullptr, t, &photon});
}

// The families at a camera walk's vertex.
template <class Real, class Weights, class Sink>
void merge_point(const sample_pair<Real, Weights>& pair, const media_map<Real>& map, const vertex<Real>& x,
                 Sink&& sink, std::vector<std::uint32_t>& found) {
    using family = mis::merge_family;
    const media_merges<Real>& merges = pair.weigh.media;
    if (merges.sizes.point_point > Real(0))
        for_each_near(map.points, x.point.position, merges.radii.point_point, [&](const auto& photon) {
            merge_in_medium(pair, family::point_point, x, photon, sink);
        });
    if (!(merges.sizes.beam_point > Real(0)))
        return;
    map.find_beams_around(x.point.position, found);
    for (const std::uint32_t i : found) {
        const beam<Real>& b = map.beams[i];
        if (const auto at = beside(b, x.point.position, merges.radii.beam_point)) {
            const auto y = vertex_on(pair.weigh, pair.scene, walk_kind::from_light, b, *at);
            merge_in_medium(pair, family::beam_point, x, photon_at(y, b.walk, pair.weigh.roulette), sink);
        }
    }
}

// The families along a camera walk's beam.
template <class Real, class Weights, class Sink>
void merge_beam(const sample_pair<Real, Weights>& pair, const media_map<Real>& map, const beam<Real>& beam,
                Sink&& sink, std::vector<std::uint32_t>& found) {
    using family = mis::merge_family;
    const media_merges<Real>& merges = pair.weigh.media;
    // The walk as it would be, had it stopped on the beam; made for the first that is near.
    std::vector<vertex<Real>> camera;
    const auto stop_at = [&](Real distance) -> const vertex<Real>& {
        if (camera.empty()) {
            camera.resize(static_cast<std::size_t>(beam.vertices));
            const vertex<Real>* from = &pair.camera[beam.place];
            for (std::size_t i = camera.size() - 1; i-- > 0; from = i > 0 ? &previous(*from) : from) {
                camera[i] = *from;
                camera[i].back = 1;
            }
        }
        return camera.back() = vertex_on(pair.weigh, pair.scene, walk_kind::from_camera, beam, distance);
    };
    if (merges.sizes.point_beam > Real(0)) {
        find_along(map.points_by_box, beam, found);
        for (const std::uint32_t i : found) {
            const photon<Real>& photon = map.points.photons[i];
            if (const auto at = beside(beam, photon.position, merges.radii.point_beam)) {
                merge_in_medium(pair, family::point_beam, stop_at(*at), photon, sink);
            }
        }
    }
    if (merges.sizes.beam_beam > Real(0)) {
        map.find_beams_along(beam, found);
        for (const std::uint32_t i : found) {
            const auto& b = map.beams[i];
            if (const auto at = across(beam, b, merges.radii.beam_beam)) {
                const auto& x = stop_at(at->first);
                const auto y = vertex_on(pair.weigh, pair.scene, walk_kind::from_light, b, at->second);
                merge_in_medium(pair, family::beam_beam, x, photon_at(y, b.walk, pair.weigh.roulette), sink);
            }
        }
    }
}

// All merges in media of a camera walk.
template <class Real, class Weights, class Sink>
void merge_all_in_media(const sample_pair<Real, Weights>& pair, const media_map<Real>& map, Sink&& sink) {
    std::vector<std::uint32_t> found;
    for (const auto& x : pair.camera)
        if (is_in_medium(x))
            merge_point(pair, map, x, sink, found);
    for (const auto& beam : pair.camera.beams)
        merge_beam(pair, map, beam, sink, found);
}

} // namespace bpt
