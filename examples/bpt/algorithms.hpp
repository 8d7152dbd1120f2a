// The well-known algorithms. Each is a set of technique counts, [H] 4.4, and whether its radius shrinks.
#pragma once

#include <map>
#include <mis/techniques.hpp>
#include <string>

namespace bpt {

template <class Real> struct algorithm {
    mis::technique_counts<Real> counts;
    bool is_progressive = false; // the radius within which walks merge shrinks from pass to pass
    bool merges_once = false;    // each camera walk ends where it can first be merged
};

// By name, with the merges of the first pass' radius. Camera walks are traced anew in every pass. Photon
// mapping as it was first published merges once, at the first vertex that is no mirror or glass: ppm. All
// others merge at every vertex where both walks can arrive, [H] 4.2 and 4.4. In media (media_options.hpp)
// upbp also merges by points and beams; the four families' names are photon mapping with each.
template <class Real> std::map<std::string, algorithm<Real>> algorithms(Real light_walks, Real merge_radius) {
    const algorithm<Real> pt{mis::path_tracing<Real>()}, pt_nee{mis::path_tracing_next_event<Real>()},
        lt{mis::light_tracing(light_walks)}, bpt{mis::bidirectional(light_walks)},
        bpm{mis::photon_mapping(light_walks, merge_radius)}, ppm{bpm.counts, true, true},
        sppm{bpm.counts, true}, ups{mis::connection_and_merging(light_walks, merge_radius), true};
    return {{"pt", pt},           {"pt-nee", pt_nee},    {"lt", lt},
            {"bpt", bpt},         {"ppm", ppm},          {"sppm", sppm},
            {"bpm", bpm},         {"ups", ups},          {"vcm", ups},
            {"upbp", ups},        {"point-point", sppm}, {"point-beam", sppm},
            {"beam-point", sppm}, {"beam-beam", sppm}};
}

// Without connections to light walks of two vertices and more, at the camera as elsewhere: next events, light
// hits and merges remain. [H] 6 and figure 14.
template <class Real> mis::technique_counts<Real> one_light_vertex(mis::technique_counts<Real> counts) {
    counts.connection = counts.camera_connection = counts.direct = 0;
    return counts;
}

// Whether there is a technique at all.
template <class Real> bool has_technique(const mis::technique_counts<Real>& c) {
    return c.light_hit + c.next_event + c.connection + c.camera_connection + c.direct + c.camera_hit +
               c.merge >
           Real(0);
}

} // namespace bpt
