#include "box_tree.hpp"
#include <algorithm>
#include <embree3/rtcore.h>

namespace bpt {

struct box_tree::embree {
    RTCDevice device = rtcNewDevice(nullptr);
    RTCScene scene = rtcNewScene(device);

    embree() = default;
    embree(const embree&) = delete;
    embree& operator=(const embree&) = delete;
    ~embree() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
};

namespace {

// A query with what it has found.
struct collecting {
    RTCIntersectContext context;
    std::vector<std::uint32_t>* found;
};

void bounds_of(const RTCBoundsFunctionArguments* a) {
    const box& b = static_cast<const box*>(a->geometryUserPtr)[a->primID];
    *a->bounds_o = {b.low.x, b.low.y, b.low.z, 0, b.high.x, b.high.y, b.high.z, 0};
}

// Never a hit: so the ray goes on to all other boxes.
void collect_along(const RTCIntersectFunctionNArguments* a) {
    reinterpret_cast<collecting*>(a->context)->found->push_back(a->primID);
}
bool collect_around(RTCPointQueryFunctionArguments* a) {
    static_cast<std::vector<std::uint32_t>*>(a->userPtr)->push_back(a->primID);
    return false; // as before: the query has not shrunk
}

bool overlaps(const box& b, const glm::vec3& low, const glm::vec3& high) {
    return glm::all(glm::lessThanEqual(b.low, high)) && glm::all(glm::lessThanEqual(low, b.high));
}

std::vector<box> grown(std::vector<box> boxes) {
    float farthest = 0;
    for (const box& b : boxes)
        for (int k = 0; k < 3; ++k)
            farthest = std::max({farthest, std::abs(b.low[k]), std::abs(b.high[k])});
    for (box& b : boxes) {
        b.low -= 2e-6f * farthest;
        b.high += 2e-6f * farthest;
    }
    return boxes;
}

} // namespace

box_tree::box_tree(std::vector<box> all) : boxes(grown(std::move(all))), tree(new embree) {
    RTCGeometry geometry = rtcNewGeometry(tree->device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(boxes.size()));
    rtcSetGeometryUserData(geometry, const_cast<box*>(boxes.data()));
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryIntersectFunction(geometry, collect_along);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tree->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(tree->scene);
}

box_tree::~box_tree() { delete tree; }

void box_tree::find_along(const glm::vec3& origin, const glm::vec3& direction, float begin, float end,
                          std::vector<std::uint32_t>& found) const {
    found.clear();
    collecting query{};
    rtcInitIntersectContext(&query.context);
    query.found = &found;
    RTCRayHit ray{};
    ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
    ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
    ray.ray.tnear = begin, ray.ray.tfar = end;
    ray.ray.mask = ~0u;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(tree->scene, &query.context, &ray);
    std::sort(found.begin(), found.end());
}

void box_tree::find_around(const glm::vec3& point, std::vector<std::uint32_t>& found) const {
    found.clear();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query{point.x, point.y, point.z, 0, 0};
    rtcPointQuery(tree->scene, &query, &context, collect_around, &found);
    const auto outside = [&](std::uint32_t i) { return !overlaps(boxes[i], point, point); };
    found.erase(std::remove_if(found.begin(), found.end(), outside), found.end()); // others of its leaf
    std::sort(found.begin(), found.end());
}

} // namespace bpt
