// Which of many boxes a ray passes, and in which a point lies: Embree's trees, with the boxes as its user
// geometry. Boxes are in float and a little larger than what they hold; who asks looks at that itself.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace bpt {

struct box {
    glm::vec3 low{0}, high{0};
};

class box_tree {
public:
    // Boxes grow by a few units in the last place of the farthest coordinate, as rays are rounded to float.
    explicit box_tree(std::vector<box> boxes);
    ~box_tree();
    box_tree(const box_tree&) = delete;
    box_tree& operator=(const box_tree&) = delete;

    // The numbers of all boxes that the segment passes, or that the point is in, in their order: whatever
    // order the tree has, sums do not depend on it.
    void find_along(const glm::vec3& origin, const glm::vec3& direction, float begin, float end,
                    std::vector<std::uint32_t>& found) const;
    void find_around(const glm::vec3& point, std::vector<std::uint32_t>& found) const;

    const std::vector<box> boxes;

private:
    struct embree;
    embree* tree = nullptr;
};

} // namespace bpt
