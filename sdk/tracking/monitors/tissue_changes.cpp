// See tissue_changes.hpp.
#include "sdk/tracking/monitors/tissue_changes.hpp"

#include <exception>

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
    try {
        cuts_.add_frame(data, output.samples, is_confirmed);
        lifted_.add_frame(data, output, is_confirmed);
        departed_.add_frame(data, output, is_confirmed, {lifted_.nodes(), lifted_.was_seen()});
        slips_.add_frame(data, output, is_confirmed,
                         slips_.wants_image() ? image_ : std::span<const uint8_t>(), helpers);
    } catch (const std::exception&) {
        cuts_.reset();  // gaps and slips still show in later frames; that tissue left does not
        slips_.reset();
    }
}

Tear TissueChanges::take_lines() {
    Tear tear;
    if (lifted_.found())
        tear = lifted_.take();
    else if (slips_.found())
        tear = {{slips_.found()->line}, slips_.found()->motions};
    else
        tear = {{*cuts_.found()}, {}};
    cuts_.reset();
    slips_.reset();
    return tear;
}

}  // namespace defrec
