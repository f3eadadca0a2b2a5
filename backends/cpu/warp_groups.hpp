// The template's points as stage warp stores them: grouped by control points, one array per
// component.
#pragma once
#include "backends/cpu/blend_clusters.hpp"
#include "backends/shared/live_depth.hpp"

namespace defrec::cpu {

struct WarpGroup {
    std::array<int32_t, kBlendNodes> node;
    uint32_t first, count;  // points; first is a multiple of kLanes
};

// Component c of point i is values[c * stride + i]: x y z, normal x y z, four weights,
// BlendWeights::first.
struct WarpPoints {
    static constexpr size_t kFirst = 6 + kBlendNodes, kComponents = kFirst + 1;
    HostVector<float> values;
    HostVector<uint32_t> source;  // where each point stands in the template
    HostVector<WarpGroup> groups;
    size_t stride = 0;

    explicit WarpPoints(const Host& host)
        : values(HostAllocator<float>(host)),
          source(HostAllocator<uint32_t>(host)),
          groups(HostAllocator<WarpGroup>(host)) {}
    void build(const defrec_surface_point* points, size_t count);
    const float* component(size_t c) const { return values.data() + c * stride; }
};

struct WarpTask {
    const WarpPoints* points;
    const NodeMotion* motions;
    defrec_camera camera;
    DisparityImage image;
    float tolerance_mm;
    defrec_surface_sample* samples;
};

// Fills the samples of groups first .. last - 1.
void warp_groups(const WarpTask& task, size_t first, size_t last);

}  // namespace defrec::cpu
