// Stage orb in shaders: the pyramid level by level, then all levels at once. docs/stages/orb.md.
#include <algorithm>
#include <utility>
#include <vector>

#include "backends/definition/orb_definition.hpp"
#include "backends/vulkan/shaders/orb_structs.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

using orb::Layout;

struct OrbPush {
    orb::OrbConstants constants;
    OrbGiven given;
};

constexpr uint32_t kBlock = 1024;  // cells that a work group of the selection looks at
// Shaders read a word or two beyond the last row.
constexpr uint64_t kSlackWords = 4;

std::vector<orb::OrbLevel> table_of(const Layout& layout) {
    const auto levels = device_levels(layout);
    return {levels.begin(), levels.begin() + layout.levels};
}
uint64_t words_of(const Layout& layout) { return device_pixels(layout) / 4 + kSlackWords; }

// Words that a row of a cell is in at most, wherever it begins.
constexpr uint32_t words_of_cell(uint32_t cell) { return (cell + 2) / 4 + 1; }

// For each orientation bin and test: both points as x, y, x, y in 8 bits.
std::vector<uint32_t> pattern_table() {
    std::vector<uint32_t> table;
    for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin) {
        const orb::Pattern pattern = orb::turned_pattern(bin);
        const auto point = [](const orb::Offset& p) {
            return uint32_t(p.x & 255) | uint32_t(p.y & 255) << 8;
        };
        for (size_t i = 0; i < pattern.size(); i += 2)
            table.push_back(point(pattern[i]) | point(pattern[i + 1]) << 16);
    }
    return table;
}

class Orb final : public Stage {
  public:
    Orb(const defrec_orb_params& params, Device& device)
        : p_(params),
          device_(device),
          layout_(orb::make_layout(params)),
          soften_(device.kernel(shaders::orb_soften, {params.halvings})),
          smooth_(device.kernel(shaders::orb_smooth)),
          corner_(device.kernel(shaders::orb_corners, {words_of_cell(params.cell)})),
          distance_(device.kernel(shaders::orb_distance)),
          count_(device.kernel(shaders::orb_count)),
          gather_(device.kernel(shaders::orb_gather)),
          describe_(device.kernel(shaders::orb_describe)),
          export_(device.kernel(shaders::orb_export)),
          levels_(device.upload(table_of(layout_))),
          patterns_(device.upload(pattern_table())),
          pyramid_(device, 4 * words_of(layout_)),
          masks_(device, pyramid_.size()),
          smoothed_(device, 2 * pyramid_.size()),
          scores_(device, pyramid_.size()),
          corners_(device, 4 * layout_.cells),
          distances_(device, layout_.cells),
          counts_(device, sizeof(OrbCounts)),
          blocks_(device, 4 * blocks_of_cells()),
          selection_(device, sizeof(OrbSelection)),
          kept_(device, 4 * uint64_t{params.capacity}) {
        for (uint32_t l = 1; l < layout_.levels;) {
            const bool two = device.wide() && l + 1 < layout_.levels;
            const Groups size = two ? Groups{kTwoColumns, kTwoRows} : Groups{32, 4};
            shrink_.push_back(
                {device.kernel(shaders::orb_shrink, {l, two ? 1u : 0u, size.x, size.y}),
                 {cover(layout_.level[l].width, 4 * size.x),
                  cover(layout_.level[l].height, 4 * size.y)}});
            l += two ? 2 : 1;
        }
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const orb::OrbBuffers given =
            orb_buffers(p_, layout_, sizes_of_inputs(in), sizes_of_outputs(out));
        const bool masked = given.mask != nullptr;
        const int exported = (given.pyramid != nullptr ? 1 : 0) |
                             (given.smoothed != nullptr ? 2 : 0) |
                             (given.scores != nullptr ? 4 : 0);
        const auto optional = [&](size_t i) { return i < out.size() ? out[i] : nullptr; };
        const Buffer& corners = optional(5) ? *out[5] : corners_;
        const Buffer& distances = optional(6) ? *out[6] : distances_;
        const Buffer* mask = masked ? in[1] : nullptr;
        const OrbPush push{constants_of(p_, layout_), {.mask = masked, .exported = exported}};
        const orb::Level& level = layout_.level[0];
        const Groups finest{cover(level.width, 4 * 32), cover(level.height, 4 * 4)};
        const Groups blocks{finest.x, finest.y, layout_.levels};

        recorder.fill(counts_, 0);
        recorder.beside(soften_, {levels_, in[0], mask, pyramid_, masks_}, push, finest);
        for (const auto& [kernel, groups] : shrink_)
            recorder.dispatch(kernel, {levels_, pyramid_, masks_}, push, groups);
        const auto score =
            device_.kernel(shaders::orb_score, {masked ? 1u : 0u, device_.wide() ? 1u : 0u});
        recorder.dispatch(score, {levels_, pyramid_, masks_, scores_}, push, blocks);
        recorder.beside(smooth_, {levels_, pyramid_, smoothed_}, push, blocks);
        const Groups cells{cover(uint64_t{level.cells_x} * level.cells_y, 128), 1, layout_.levels};
        recorder.dispatch(corner_, {levels_, scores_, corners}, push, cells);
        recorder.dispatch(distance_, {levels_, corners, distances, counts_}, push,
                          {cover(level.cells_x, 16), cover(level.cells_y, 8), layout_.levels});
        const Groups selection{blocks_of_cells()};
        recorder.dispatch(count_, {levels_, corners, distances, counts_, selection_, blocks_}, push,
                          selection);
        recorder.dispatch(gather_,
                          {levels_, corners, distances, blocks_, selection_, kept_, out[0]}, push,
                          selection);
        recorder.dispatch_indirect(
            describe_, {levels_, pyramid_, smoothed_, corners, kept_, patterns_, out[1]}, push,
            selection_);
        if (exported != 0)
            recorder.beside(
                export_,
                {levels_, pyramid_, smoothed_, scores_, optional(2), optional(3), optional(4)},
                push, {cover(level.width, 32), cover(level.height, 8), layout_.levels});
    }

  private:
    // At least one, which counts none where there are no cells.
    uint32_t blocks_of_cells() const { return std::max(cover(layout_.cells, kBlock), 1u); }

    defrec_orb_params p_;
    Device& device_;
    Layout layout_;
    std::shared_ptr<const Kernel> soften_, smooth_, corner_, distance_, count_, gather_, describe_,
        export_;
    // To levels 1, 2 ... with the work groups of each.
    std::vector<std::pair<std::shared_ptr<const Kernel>, Groups>> shrink_;
    Buffer levels_, patterns_;
    // Images as shaders/orb.glsl lays them out, then what there is one of for each cell.
    Buffer pyramid_, masks_, smoothed_, scores_, corners_, distances_;
    Buffer counts_, blocks_, selection_, kept_;
};

}  // namespace

std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Orb>(params, device);
}

}  // namespace defrec::vulkan
