// See pairings.hpp.
#include "sdk/doctor/pairings.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/row_fit.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorPairings;

bool may_be_late(const Evidence& evidence) {
    return evidence.has_depth() && (evidence.as_given().row_error_px > Decision::kMinRowMotion ||
                                    evidence.probe.frames_with(DEFREC_REASON_VIEW_LATE) > 0);
}

using Frames = std::vector<StereoFrame>;

// Left views to match, from the first frame on.
std::vector<int> frames_to_match(const Frames& frames) {
    std::vector<int> chosen;
    FramesToMatch to_match(frames.size(), Decision::kMatchedFrames);
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (to_match.takes(look_of(frames[i]).is_blank())) chosen.push_back(static_cast<int>(i));
    return chosen;
}

// The frame whose right view is paired with this one's left view; null: there is none.
const StereoFrame* partner_of(int frame, int later, const Frames& frames) {
    const int partner = frame + later;
    if (partner < 0 || partner >= static_cast<int>(frames.size())) return nullptr;
    const StereoFrame& found = frames[static_cast<std::size_t>(partner)];
    return look_of(found).is_blank() ? nullptr : &found;
}

struct Rows {
    std::map<int, double> misfits;  // by frame
    double error_px = 0;
};

Rows rows_of(const Frames& frames, const std::vector<int>& chosen, int later,
             const StereoCalibration& calibration) {
    std::vector<ViewMatch> matches;
    for (const int frame : chosen) {
        throw_if_interrupted();
        const StereoFrame* const partner = partner_of(frame, later, frames);
        if (partner == nullptr) continue;
        const ImageView& left = frames[static_cast<std::size_t>(frame)].left;
        for (ViewMatch match : match_views(gray_of(left), gray_of(partner->right))) {
            match.pair = frame;
            matches.push_back(match);
        }
    }
    const RigTrial trial = try_rig(calibration, matches, Mistake::kNone);
    return {misfits_of_pairs(trial.matches, fit_rows(trial.matches)), trial.row_error_px};
}

// Views with too few matches in it are no better in it.
Pairing pairing_of(int later, const Frames& frames, const Rows& rows, const Rows& as_given) {
    Pairing pairing{later, 0, !rows.misfits.empty(), rows.error_px};
    for (const auto& [frame, given] : as_given.misfits) {
        if (partner_of(frame, later, frames) == nullptr) continue;
        const auto found = rows.misfits.find(frame);
        const bool is_worse =
            found == rows.misfits.end() || found->second > given + Decision::kWorse;
        pairing.is_never_worse = pairing.is_never_worse && !is_worse;
    }
    for (const auto& [frame, misfit] : rows.misfits)
        pairing.row_motion_px += misfit / static_cast<double>(rows.misfits.size());
    return pairing;
}

const Pairing* as_they_are(const std::vector<Pairing>& pairings) {
    const auto given = std::find_if(pairings.begin(), pairings.end(),
                                    [](const Pairing& pairing) { return pairing.later == 0; });
    return given == pairings.end() ? nullptr : &*given;
}

}  // namespace

void try_pairings(const std::vector<StereoFrame>& frames, Evidence& evidence) {
    if (!may_be_late(evidence)) return;
    const std::vector<int> chosen = frames_to_match(frames);
    const StereoCalibration calibration = fitting_calibration(evidence);
    const Rows as_given = rows_of(frames, chosen, 0, calibration);
    if (as_given.misfits.empty()) return;
    for (int later = -Decision::kMostFrames; later <= Decision::kMostFrames; ++later)
        evidence.pairings.push_back(pairing_of(
            later, frames, later == 0 ? as_given : rows_of(frames, chosen, later, calibration),
            as_given));
}

const Pairing* better_pairing(const std::vector<Pairing>& pairings) {
    const Pairing* best = nullptr;
    for (const Pairing& pairing : pairings)
        if (pairing.is_never_worse &&
            (best == nullptr || pairing.row_motion_px < best->row_motion_px))
            best = &pairing;
    if (best == nullptr || best->later == 0) return nullptr;
    const double given_px = as_they_are(pairings)->row_motion_px;
    return best->row_motion_px <= Decision::kAgree &&
                   best->row_motion_px <= Decision::kBetter * given_px &&
                   best->row_motion_px <= given_px - Decision::kLess
               ? best
               : nullptr;
}

const Pairing* likely_pairing(double lag, const std::vector<Pairing>& pairings) {
    const Pairing* const given = as_they_are(pairings);
    if (given == nullptr) return nullptr;
    const auto best = std::min_element(
        pairings.begin(), pairings.end(),
        [](const Pairing& a, const Pairing& b) { return a.row_error_px < b.row_error_px; });
    const bool is_clear =
        std::all_of(pairings.begin(), pairings.end(), [&](const Pairing& pairing) {
            return pairing.later == best->later ||
                   best->row_error_px < Decision::kClearlyBest * pairing.row_error_px;
        });
    // Beyond the last pairing rows may agree better still.
    const bool is_inside = std::abs(best->later) < Decision::kMostFrames;
    return is_clear && is_inside && best->later * lag > 0 && std::abs(best->later - lag) <= 1 &&
                   best->is_never_worse && best->row_motion_px <= given->row_motion_px
               ? &*best
               : nullptr;
}

bool is_of_no_pairing(const std::vector<Pairing>& pairings) {
    const Pairing* given = as_they_are(pairings);
    return given != nullptr && given->row_motion_px > Decision::kMinRowMotion &&
           better_pairing(pairings) == nullptr;
}

}  // namespace defrec::cli
