// See template_search.hpp.
#include "sdk/session/template_search.hpp"

#include <utility>

#include "sdk/contract/descs.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/session/decisions.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::TemplateSearch;

// One tracker, and the template that it follows.
class Scout {
  public:
    explicit Scout(const TemplateSearchInput& input) : desc_(input.desc) {
        // Nobody sees its results.
        desc_.body = DEFREC_BODY_OFF;
        desc_.grow = desc_.keep_disparity = desc_.timed = 0;
        fill_defaults(desc_);
        restart(input);
    }

    // Begins with the next frame.
    void restart(const TemplateSearchInput& input) {
        forget();
        epoch_ = 0;
        tracker_.reset();
        defrec_tracker tracker = nullptr;
        require(defrec_tracker_create(input.context.get(), input.rig.get(), &desc_, &tracker),
                input.refusal, "creating the tracker");
        tracker_.reset(tracker);
    }

    // true: the frame shows far more of the tissue than the template's own.
    bool add(const StereoFrame& frame) {
        const Job job = submit(tracker_, frame);
        const defrec_result result = result_of(job, frame.index);
        reasons_ = result.reasons;
        const bool has_changed =
            std::exchange(epoch_, result.template_epoch) != result.template_epoch;
        if (result.template_epoch == 0) forget();
        if (has_changed && (result.reasons & DEFREC_REASON_CUT) == 0 && epoch_ != 0) {
            take_template(job, frame, result);
            return false;
        }
        if (!found_) return false;
        ++frames_after_;
        if (result.state == DEFREC_LOST) return false;
        is_confirmed_ = true;
        return result.features >= Decision::kRicher * features_ &&
               Decision::kRichest * result.features >= desc_.max_features;
    }

    bool is_settled() const {
        return found_ && is_confirmed_ &&
               (frames_after_ >= Decision::kLookAhead ||
                Decision::kRicher * features_ > desc_.max_features);
    }
    std::optional<FoundTemplate> take() { return std::move(found_); }
    std::uint32_t reasons() const { return reasons_; }  // of the last frame

  private:
    void forget() {
        found_.reset();
        frames_after_ = 0;
        is_confirmed_ = false;
    }

    void take_template(const Job& job, const StereoFrame& frame, const defrec_result& result) {
        forget();
        features_ = result.features;
        defrec_template surface = nullptr;
        require(defrec_job_get_template(job.get(), &surface), ExitCode::kInternal,
                "reading the template");
        found_.emplace(FoundTemplate{Template(surface), frame});
    }

    defrec_tracker_desc desc_;
    Tracker tracker_;
    std::optional<FoundTemplate> found_;
    std::uint32_t epoch_ = 0, features_ = 0, reasons_ = 0;
    std::int64_t frames_after_ = 0;
    bool is_confirmed_ = false;
};

}  // namespace

std::optional<FoundTemplate> find_template(const TemplateSearchInput& input) {
    FrameSource source(input.source);
    Scout scout(input);
    StereoFrame frame;
    while (!scout.is_settled() && !interrupt_requested() && source.next(frame)) {
        if (!scout.add(frame)) continue;
        scout.restart(input);
        scout.add(frame);
    }
    std::optional<FoundTemplate> found = scout.take();
    if (found && found->frame.index == input.source.range.first) found.reset();
    return found;
}

FoundTemplate capture_template_of(const TemplateSearchInput& input, std::int64_t frame) {
    SourceOptions options = input.source;
    options.range = {frame, frame + 1};
    FrameSource source(options);
    Scout scout(input);
    StereoFrame image;
    if (source.next(image)) scout.add(image);
    std::optional<FoundTemplate> found = scout.take();
    if (!found) {
        const std::string reasons = reason_names(scout.reasons(), ", ");
        throw CliError(ExitCode::kInput, "--template-frame: frame " + std::to_string(frame) +
                                             " gives no template" +
                                             (reasons.empty() ? "." : ": " + reasons + "."));
    }
    return std::move(*found);
}

}  // namespace defrec::cli
