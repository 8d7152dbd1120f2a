// What a renderer does with the library, in a page: weigh next event against BSDF sampling, then every
// technique of one complete path with the renderer's own vectors.
#include <cmath>
#include <cstdio>
#include <mis/mis.hpp>

#if MIS_VERSION < 100
#error "needs mis 0.1.0 or newer"
#endif

struct vec {
    double x, y, z;
};
constexpr vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

int main() {
    const double next_event = mis::power(2.0, 1.0);
    if (std::abs(next_event - 0.8) > 1e-12)
        return 1;

    mis::path_vertex<vec> path[3];
    path[0].kind = mis::vertex_kind::camera;
    path[0].dirac = true;
    path[0].position = {0, 0, 1};
    path[0].normal = {0, 0, -1};
    path[0].pdf_position = path[0].pdf_next_event = 1;
    path[0].pdf_to_light = 4;
    path[1].position = {0, 0, 0};
    path[1].normal = {0, 0, 1};
    path[1].pdf_to_light = path[1].pdf_to_camera = 0.25;
    path[2].kind = mis::vertex_kind::light;
    path[2].position = {0, 1, 1};
    path[2].normal = {0, 0, -1};
    path[2].pdf_position = path[2].pdf_next_event = 2;
    path[2].pdf_to_camera = 0.125;

    double weights[5];
    mis::weights(mis::balance, mis::bidirectional<double>(100), path, 3, weights);
    double sum = 0;
    for (double weight : weights) {
        std::printf("%.6f ", weight);
        sum += weight;
    }
    std::printf("sum %.17g\n", sum);
    return std::abs(sum - 1) < 1e-12 ? 0 : 1;
}
