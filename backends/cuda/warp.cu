// Stage warp, one thread per point. docs/stages/warp.md.
#include "backends/cuda/stages.hpp"
#include "backends/stages/warp.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kThreads =
    64;  // small blocks, so that a few thousand points reach all multiprocessors

// The template's points in parts, so that neighbouring threads load side by side.
struct Points {
    const float4* place;   // position, normal x
    const float2* facing;  // normal y, z
    const int4* node;
    const float4* weight;
};

__device__ uint32_t observe(const defrec_warp_params& p, const DisparityImage& image,
                            const Vec3<float>& position, const Vec3<float>& normal,
                            float& residual) {
    residual = 0;
    Pixel<float> pixel{};
    if (!project_inside(p.camera, image, position, pixel)) return DEFREC_OUTSIDE;
    const float depth = live_depth(p.camera, image, pixel);
    if (depth == 0) return DEFREC_NO_DEPTH;
    residual = depth - position.z;
    if (!(dot(normal, position) < 0)) return DEFREC_INCONSISTENT;
    if (std::abs(residual) <= p.tolerance_mm) return DEFREC_OBSERVED;
    return residual < 0 ? DEFREC_OCCLUDED : DEFREC_INCONSISTENT;
}

__global__ void __launch_bounds__(kThreads)
    warp(defrec_warp_params p, Points points, WarpBuffers b) {
    const uint32_t i = blockIdx.x * kThreads + threadIdx.x;
    if (i >= p.points) return;
    const float4 place = points.place[i], weights = points.weight[i];
    const float2 facing = points.facing[i];
    const int4 nodes = points.node[i];
    const int32_t node[DEFREC_BLEND_NODES] = {nodes.x, nodes.y, nodes.z, nodes.w};
    const float weight[DEFREC_BLEND_NODES] = {weights.x, weights.y, weights.z, weights.w};
    const defrec_motion* const motions = b.motions;
    const auto motion = blend_with<float>(
        [motions](int32_t k) { return usable_motion<float>(motions[k]); }, node, weight);
    const Vec3<float> position = apply(motion, Vec3<float>{place.x, place.y, place.z});
    const Vec3<float> normal = rotate(motion, Vec3<float>{place.w, facing.x, facing.y});
    float residual = 0;
    const uint32_t observation =
        observe(p, disparity_image(p, b.disparity), position, normal, residual);
    auto* const samples = reinterpret_cast<float4*>(b.samples);
    samples[2 * uint64_t{i}] = make_float4(position.x, position.y, position.z, normal.x);
    samples[2 * uint64_t{i} + 1] =
        make_float4(normal.y, normal.z, residual, __uint_as_float(observation));
}

class Warp final : public Stage {
  public:
    Warp(const defrec_warp_params& params, Device& device) : p_(params), device_(device) {}

    bool reentrant() const override { return true; }
    void prepare(std::span<const InBuffer> in) override {
        const defrec_surface_point* points = read_template(p_, in).points;
        std::vector<float4> place, weight;
        std::vector<float2> facing;
        std::vector<int4> node;
        for (const defrec_surface_point& point : std::span(points, p_.points)) {
            place.push_back(
                {point.position[0], point.position[1], point.position[2], point.normal[0]});
            facing.push_back({point.normal[1], point.normal[2]});
            node.push_back({point.node[0], point.node[1], point.node[2], point.node[3]});
            weight.push_back({point.weight[0], point.weight[1], point.weight[2], point.weight[3]});
        }
        points_ = {upload(device_, place), upload(device_, facing), upload(device_, node),
                   upload(device_, weight)};
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        if (!points_.place) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        const auto given = view_buffers<WarpBuffers>(p_, in, out);
        const Points points{points_.place.as<float4>(), points_.facing.as<float2>(),
                            points_.node.as<int4>(), points_.weight.as<float4>()};
        recorder.launch(warp, {dim3(cover(p_.points, kThreads)), dim3(kThreads)}, p_, points,
                        given);
    }

  private:
    defrec_warp_params p_;
    Device& device_;
    struct {
        Buffer place, facing, node, weight;
    } points_;
};

}  // namespace

std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Warp>(params, device);
}

}  // namespace defrec::cuda
