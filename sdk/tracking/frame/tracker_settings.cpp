// See tracker_settings.hpp.
#include "sdk/tracking/frame/tracker_settings.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/check_ranges.hpp"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/rig/rig.hpp"

namespace defrec {

namespace {

using decisions::Grids;

void expect_bounded(const char* name, float spacing, const char* what, double max, const Rig& rig) {
    const double count = std::ceil(static_cast<double>(rig.width()) / spacing) *
                         std::ceil(static_cast<double>(rig.height()) / spacing);
    if (count > max)
        fail(DEFREC_ERROR_ARGUMENT, "desc.", name, " is ", spacing, " px: that would be ", count,
             " ", what, " in images of ", rig.width(), " x ", rig.height(), " px, at most ", max,
             " are possible");
}

}  // namespace

TrackerSettings with_defaults(const defrec_tracker_desc& desc) {
    TrackerSettings settings{desc, {}};
    fill_defaults(settings);
    return settings;
}

TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig) {
    check_ranges(desc);
    TrackerSettings settings = with_defaults(desc);
    settings.device_id = nullptr;  // the caller's
    // What is measured beside the surface is followed until the surface reaches it.
    if (settings.grow != 0) settings.keep_disparity = 1;
    const float width = static_cast<float>(rig.width());
    if (settings.node_spacing_px == 0) settings.node_spacing_px = default_node_spacing(rig.width());
    if (settings.vertex_spacing_px == 0)
        settings.vertex_spacing_px =
            std::max(Grids::kMinVertexSpacing, width / Grids::kVerticesAcross);
    expect_bounded("vertex_spacing_px", settings.vertex_spacing_px, "vertices", Grids::kMaxVertices,
                   rig);
    expect_bounded("node_spacing_px", settings.node_spacing_px, "control points", Grids::kMaxNodes,
                   rig);
    const uint32_t row = rig.width() * bytes_per_pixel(settings.format);
    if (settings.memory_stride == 0) settings.memory_stride = row;
    if (settings.memory_stride < row)
        fail(DEFREC_ERROR_ARGUMENT, "memory_stride is ", settings.memory_stride,
             " bytes, at least ", row, " (a row of the rig's images) expected");
    return settings;
}

}  // namespace defrec
