// See tissue_changes.hpp.
#include "sdk/tracking/monitors/tissue_changes.hpp"

#include <atomic>
#include <exception>

#include "sdk/base/os/helped_loop.hpp"

namespace defrec {

void TissueChanges::reset() {
    cuts_.reset();
    slips_.reset();
    departed_.reset();
    lifted_.reset();
}

void TissueChanges::add_frame(const TemplateData& data, const FrameOutput& output,
                              std::span<const uint8_t> is_confirmed,
                              const Services* helpers) noexcept {
    std::atomic<bool> has_failed = false;
    // The slips share their own work where they look at the image.
    helped_loop(slips_.wants_image() ? nullptr : helpers, 3, [&](size_t part) {
        try {
            if (part == 0) {
                lifted_.add_frame(data, output, is_confirmed);
                departed_.add_frame(data, output, is_confirmed,
                                    {lifted_.nodes(), lifted_.was_seen()});
            } else if (part == 1) {
                slips_.add_frame(data, output, is_confirmed,
                                 slips_.wants_image() ? image_ : std::span<const uint8_t>(),
                                 helpers);
            } else {
                cuts_.add_frame(data, output.samples, is_confirmed);
            }
        } catch (const std::exception&) {
            has_failed = true;
        }
    });
    if (!has_failed) return;
    cuts_.reset();  // gaps and slips still show in later frames; that tissue left does not
    slips_.reset();
}

Tear TissueChanges::found_lines() const {
    if (lifted_.found()) return *lifted_.found();
    if (slips_.found()) return {{slips_.found()->line}, slips_.found()->motions};
    return {{*cuts_.found()}, {}};
}

void TissueChanges::end_release() {
    if (lifted_.found()) lifted_.end_release();
    cuts_.reset();
    slips_.end_release();
}

}  // namespace defrec
