// Each finding with a recording that shows it, and none where nothing is wrong.
#include "sdk/doctor/doctor.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/pairings.hpp"
#include "sdk/doctor/test_recordings.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/test_refusal.hpp"
#include "sdk/scenes/writing/render_command.hpp"

using namespace defrec::cli;

namespace {

// A scene as a recording, rendered once.
const Recording& rendered(const std::string& scene) {
    static std::map<std::string, Recording> recordings;
    const auto known = recordings.find(scene);
    if (known != recordings.end()) return known->second;
    const TestFolder folder;
    RenderOptions options;
    options.scene = scene;
    options.out_dir = folder.path().string();
    options.width = 480;
    options.height = 270;
    options.frames = 12;
    render_sequence(options, {});
    return recordings[scene] = read_recording(folder.path());
}

Diagnosis diagnose_spoiled(const std::string& scene, const Spoil& spoil,
                           const std::function<void(DoctorOptions&)>& change = {}) {
    Recording recording = rendered(scene);
    for_each_image(recording, [](cv::Mat& image) { image = image.clone(); });
    spoil(recording);
    const TestFolder folder;
    write_recording(recording, folder.path());
    DoctorOptions options = options_for(folder.path());
    if (change) change(options);
    return diagnose(options);
}

std::string found(const std::string& scene, const Spoil& spoil,
                  const std::function<void(DoctorOptions&)>& change = {}) {
    return found_in(diagnose_spoiled(scene, spoil, change));
}

void as_it_is(Recording&) {}

Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation_of(StereoCalibration& rig) {
    return Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rig.rotation.data());
}
Eigen::Map<Eigen::Vector3d> translation_of(StereoCalibration& rig) {
    return Eigen::Map<Eigen::Vector3d>(rig.translation.data());
}

Finding finding_of(const Diagnosis& diagnosis, const char* id) {
    for (const Finding& finding : diagnosis.findings)
        if (finding.id == id) return finding;
    return {};
}

// Frames of the right view that are black or white from edge to edge.
Spoil blanked_right(std::size_t first, std::size_t last, double gray) {
    return [=](Recording& r) {
        for (std::size_t i = first; i <= last; ++i)
            r.right[i] = cv::Mat(r.right[i].size(), r.right[i].type(), cv::Scalar::all(gray));
    };
}

Spoil blanked(std::size_t first, std::size_t last, double gray) {
    return [=](Recording& r) {
        blanked_right(first, last, gray)(r);
        for (std::size_t i = first; i <= last; ++i) r.left[i] = r.right[i];
    };
}

// px, of the first frame.
double median_disparity(const std::string& scene) {
    const Recording& recording = rendered(scene);
    cv::Mat left, right;
    cv::cvtColor(recording.left.front(), left, cv::COLOR_BGR2GRAY);
    cv::cvtColor(recording.right.front(), right, cv::COLOR_BGR2GRAY);
    std::vector<double> disparities;
    for (const ViewMatch& match : match_views(left, right))
        disparities.push_back(match.left.x - match.right.x);
    return nearest_rank(disparities, 0.5);
}

}  // namespace

TEST_CASE("nothing is found where nothing is wrong: rectified and raw views") {
    for (const char* scene : {"heartbeat", "respiration"}) {
        CAPTURE(scene);
        CHECK(found(scene, as_it_is) == "");
    }
}

TEST_CASE("a round aperture, black borders and burnt-in text are nothing wrong") {
    for (const char* scene : {"heartbeat", "respiration"}) {
        CAPTURE(scene);
        CHECK(found(scene, [](Recording& r) { for_each_image(r, dress); }) == "");
    }
}

TEST_CASE("row 111: a picture between black bars, at its sides or above and below") {
    const auto narrowed = [](double across, double down) {
        return [=](Recording& r) {
            for_each_image(r, [=](cv::Mat& image) {
                const cv::Size size(cvRound(across * image.cols), cvRound(down * image.rows));
                cv::Mat small, framed(image.size(), image.type(), cv::Scalar::all(0));
                cv::resize(image, small, size, 0, 0, cv::INTER_AREA);
                small.copyTo(framed(cv::Rect(
                    {(image.cols - size.width) / 2, (image.rows - size.height) / 2}, size)));
                image = framed;
            });
        };
    };
    const auto bars_in = [](const Diagnosis& diagnosis) {
        for (const Finding& finding : diagnosis.findings)
            if (finding.id == "bars") return finding;
        return Finding{};
    };
    const Finding sides = bars_in(diagnose_spoiled("heartbeat", narrowed(0.75, 1)));
    CHECK(sides.verdict == Verdict::kFound);
    CHECK(*sides.value == doctest::Approx(25).epsilon(0.05));
    const Finding ends = bars_in(diagnose_spoiled("heartbeat", narrowed(1, 0.8)));
    CHECK(ends.verdict == Verdict::kFound);
    CHECK(ends.what.find("above and below") != std::string::npos);
}

TEST_CASE("exchanged views, cameras and names") {
    CHECK(found("heartbeat", [](Recording& r) { std::swap(r.left, r.right); }) == "order");
    CHECK(found("respiration", [](Recording& r) { std::swap(r.left, r.right); }) == "order");
    CHECK(found("respiration", [](Recording& r) {
              std::swap(r.calibration.left, r.calibration.right);
          }) == "order");
    // The whole pair is named the other way round.
    CHECK(found("respiration", [](Recording& r) {
              std::swap(r.left, r.right);
              std::swap(r.calibration.left, r.calibration.right);
              rotation_of(r.calibration).transposeInPlace();
              translation_of(r.calibration) =
                  (-(rotation_of(r.calibration) * translation_of(r.calibration))).eval();
          }) == "order");
}

TEST_CASE("a view that is shifted to the side is not taken for exchanged ones without a word") {
    const auto shifted = [](int px) {
        return finding_of(diagnose_spoiled("heartbeat",
                                           [=](Recording& r) {
                                               const int width = r.calibration.width - px;
                                               crop(r.left, px, width);
                                               crop(r.right, 0, width);
                                               r.calibration.width = width;
                                               r.calibration.left.cx -= px / 2.0;
                                               r.calibration.right.cx -= px / 2.0;
                                           }),
                          "order");
    };
    // By about the disparity of the tissue.
    const double disparity = median_disparity("heartbeat");
    const Finding part = shifted(static_cast<int>(disparity));
    CHECK(part.verdict == Verdict::kFound);
    CHECK_SAYS(part.what, "disparities are shifted, they run from -");
    CHECK_SAYS(part.remedy, "See whether one view was cropped");
    // By more than all of it: exchanged views look like that.
    const Finding all = shifted(static_cast<int>(1.8 * disparity));
    CHECK_SAYS(all.what, "with left and right exchanged the tissue lies ");
    CHECK_SAYS(all.remedy, "If the tissue was elsewhere, the disparities are shifted");
}

TEST_CASE("R and T of the wrong direction") {
    CHECK(found("respiration", [](Recording& r) {
              rotation_of(r.calibration).transposeInPlace();
              translation_of(r.calibration) =
                  (-(rotation_of(r.calibration) * translation_of(r.calibration))).eval();
          }) == "pose");
    CHECK(found("respiration",
                [](Recording& r) { rotation_of(r.calibration).transposeInPlace(); }) == "pose");
    CHECK(found("heartbeat", [](Recording& r) { translation_of(r.calibration) *= -1; }) == "pose");
}

TEST_CASE("T in another unit") {
    for (const double unit : {1e-3, 0.1, 1 / 25.4, 1e3}) {
        CAPTURE(unit);
        CHECK(found("heartbeat", [&](Recording& r) { translation_of(r.calibration) *= unit; }) ==
              "units");
    }
}

TEST_CASE("a baseline that is not plausible for the depth") {
    CHECK(found("heartbeat", [](Recording& r) { translation_of(r.calibration) *= 20; }) ==
          "baseline");
}

TEST_CASE("a calibration for images of another size") {
    const auto half = [](Recording& r) {
        for_each_image(
            r, [](cv::Mat& image) { cv::resize(image, image, {}, 0.5, 0.5, cv::INTER_AREA); });
    };
    CHECK(found("heartbeat", half) == "resolution");
    CHECK(found("heartbeat", [&](Recording& r) {
              half(r);
              r.calibration.width = r.calibration.height = 0;
          }) == "resolution");
    // Squeezed, as by a recorder with another picture.
    CHECK(found("heartbeat", [](Recording& r) {
              for_each_image(r, [](cv::Mat& image) {
                  cv::resize(image, image, {360, 270}, 0, 0, cv::INTER_AREA);
              });
          }) == "resolution");
}

TEST_CASE("interlaced video") {
    CHECK(found("heartbeat", [](Recording& r) {
              interlace(r.left);
              interlace(r.right);
          }) == "interlacing");
    const Diagnosis diagnosis = diagnose_spoiled(
        "heartbeat",
        [](Recording& r) {
            interlace(r.left);
            interlace(r.right);
        },
        [](DoctorOptions& options) { options.source.fields = FieldOrder::kAuto; });
    CHECK(found_in(diagnosis).empty());
    CHECK(diagnosis_text(diagnosis).find("interlaced, bottom field first") != std::string::npos);
}

TEST_CASE("exposure") {
    for (const double gain : {6.0, 0.05}) {
        CAPTURE(gain);
        const Diagnosis diagnosis = diagnose_spoiled("heartbeat", [&](Recording& r) {
            for_each_image(r, [&](cv::Mat& image) { image *= gain; });
        });
        CHECK(found_in(diagnosis) == "exposure");
        const Finding exposure = finding_of(diagnosis, "exposure");
        CHECK_SAYS(exposure.what, gain > 1 ? "both views are overexposed" : "both views are ");
        CHECK_SAYS(exposure.remedy, "the light, the gain or the exposure time");
        CHECK(exposure.remedy.find("cable") == std::string::npos);
    }
    CHECK(found("heartbeat", [](Recording& r) {
              for (cv::Mat& image : r.right) image = cv::Scalar::all(0);
          }) == "exposure");
}

TEST_CASE("black frames are named, and what to do about them") {
    const Diagnosis few = diagnose_spoiled("heartbeat", blanked(4, 5, 0));
    CHECK(found_in(few) == "black_frames");
    const Finding black = finding_of(few, "black_frames");
    CHECK(black.what.find("in 2 of 12 frames both views are black, and nothing") == 0);
    CHECK(black.what.find(": frames 4 to 5.") != std::string::npos);
    CHECK_SAYS(black.remedy, "leave them in: the surface is found again");
    CHECK_SAYS(black.remedy, "by --frames 6:, with points chosen in those frames");
    const Diagnosis right = diagnose_spoiled("heartbeat", blanked_right(7, 7, 0));
    CHECK(finding_of(right, "black_frames").what.find("in 1 of 12 frames the right view is") == 0);
    const Diagnosis all = diagnose_spoiled("heartbeat", blanked(0, 11, 0));
    CHECK(found_in(all) == "exposure");
    CHECK(finding_of(all, "exposure").what ==
          "both views are black: 100 % of each is no brighter than gray level 6 of 255.");
    for (const char* id : {"black_frames", "interlacing"})
        CHECK(finding_of(all, id).verdict == Verdict::kUnknown);
}

TEST_CASE("black frames at an end: begin behind the first ones, nothing comes after the last") {
    const Diagnosis begun = diagnose_spoiled("heartbeat", [](Recording& r) {
        blanked(0, 4, 0)(r);
        blanked(9, 9, 0)(r);
    });
    CHECK(found_in(begun) == "black_frames");
    CHECK_SAYS(finding_of(begun, "black_frames").what, ": frames 0 to 4, 9.");
    CHECK_SAYS(finding_of(begun, "black_frames").remedy, "begin behind them by --frames 5:");
    const Diagnosis ended = diagnose_spoiled("heartbeat", blanked_right(9, 11, 0));
    CHECK(finding_of(ended, "black_frames").remedy == "Check light, shutter and cable.");
}

TEST_CASE("black frames are a problem where they are most, and the others are looked at") {
    const Diagnosis some = diagnose_spoiled("heartbeat", blanked_right(3, 7, 0));
    CHECK(found_in(some) == "black_frames");
    CHECK(finding_of(some, "black_frames").severity == Severity::kWarning);
    for (const char* id : {"bars", "sharpness", "one_view_twice", "common_content"})
        CHECK(finding_of(some, id).verdict == Verdict::kFine);
    const Diagnosis most = diagnose_spoiled("heartbeat", blanked_right(3, 11, 0));
    CHECK(found_in(most) == "black_frames");
    CHECK(finding_of(most, "black_frames").severity == Severity::kError);
}

TEST_CASE("white frames are counted, and not averaged with the others") {
    const Diagnosis diagnosis = diagnose_spoiled("heartbeat", blanked_right(4, 6, 255));
    CHECK(found_in(diagnosis) == "white_frames");
    CHECK(finding_of(diagnosis, "white_frames").what ==
          "in 3 of 12 frames the right view is white, and no depth is measured: frames 4 to 6.");
}

TEST_CASE("frames that repeat the ones before: of one view, or of both for long") {
    const auto frozen = [](std::vector<cv::Mat>& images, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i <= last; ++i) images[i] = images[first - 1];
    };
    const Diagnosis right =
        diagnose_spoiled("heartbeat", [&](Recording& r) { frozen(r.right, 5, 6); });
    CHECK(finding_of(right, "repeated_frames").verdict == Verdict::kFound);
    CHECK(finding_of(right, "repeated_frames").what ==
          "in 2 of 12 frames the right view repeats the one before, and depth is wrong: frames 5 "
          "to 6.");
    CHECK_SAYS(finding_of(right, "repeated_frames").remedy, "leave these frames in");
    const Finding all =
        finding_of(diagnose_spoiled("heartbeat", [&](Recording& r) { frozen(r.right, 1, 11); }),
                   "repeated_frames");
    CHECK(all.what.find("frames the right view repeats the one before") != std::string::npos);
    CHECK(all.what.find(": frames") == std::string::npos);
    CHECK_SAYS(all.remedy, "Record anew");
    const auto of_both = [&](std::size_t first, std::size_t last) {
        return finding_of(diagnose_spoiled("heartbeat",
                                           [&](Recording& r) {
                                               frozen(r.left, first, last);
                                               frozen(r.right, first, last);
                                           }),
                          "repeated_frames");
    };
    CHECK(of_both(4, 7).what.find("in 4 of 12 frames both views repeat those before") == 0);
    // As of a recorder of more frames than the camera gives.
    CHECK(of_both(4, 5).verdict == Verdict::kFine);
}

TEST_CASE("a recording that cannot be read to the end is refused") {
    const TestFolder folder;
    write_recording(rendered("heartbeat"), folder.path());
    DoctorOptions options = options_for(folder.path());
    options.source.times = folder.write("times.csv", "0\n33\n66\n");
    CHECK_SAYS(refusal_of([&] { diagnose(options); }), "times.csv");
    options.source.range.first = 5;  // where no frame has a time
    CHECK_SAYS(refusal_of([&] { diagnose(options); }), "times.csv");
}

TEST_CASE("black bars whose edges lie on the grid of blocks are no compression") {
    CHECK(found("heartbeat", [](Recording& r) {
              for_each_image(r, [](cv::Mat& image) {
                  image.rowRange(0, 40) = cv::Scalar::all(0);
                  image.rowRange(image.rows - 38, image.rows) = cv::Scalar::all(0);
              });
          }) == "bars");
}

TEST_CASE("strong compression") {
    CHECK(found("heartbeat", [](Recording& r) {
              for_each_image(r, [](cv::Mat& image) { compress(image, 15); });
          }) == "compression");
}

TEST_CASE("row 161: blocks copied by a codec whose filter leaves no borders of blocks") {
    const Diagnosis diagnosis = diagnose_spoiled("compressed", as_it_is);
    CHECK(found_in(diagnosis) == "compression");
    const auto finding = std::find_if(diagnosis.findings.begin(), diagnosis.findings.end(),
                                      [](const Finding& each) { return each.id == "compression"; });
    CHECK(finding->what.find("copies of the frame before") != std::string::npos);
    CHECK(finding->what.find("beyond use") == std::string::npos);
    CHECK(finding->unit == "%");
    CHECK(finding->severity == Severity::kWarning);
}

TEST_CASE("row 161: a video that is compressed beyond use") {
    // An eighth of the contrast makes the steps of the quantiser 8 times as large.
    const Spoil spoil = [](Recording& r) { encode(r, 0.125); };
    const Diagnosis diagnosis = diagnose_spoiled("heartbeat", spoil);
    const auto finding = std::find_if(diagnosis.findings.begin(), diagnosis.findings.end(),
                                      [](const Finding& each) { return each.id == "compression"; });
    CHECK(finding->verdict == Verdict::kFound);
    CHECK_MESSAGE(finding->what.find("beyond use") != std::string::npos, finding->what);
    CHECK(finding->what.find("there is no depth in") != std::string::npos);
    CHECK(finding->severity == Severity::kError);
}

TEST_CASE("row 161: depth that rows cost is not laid to compression") {
    const Diagnosis diagnosis = diagnose_spoiled("heartbeat", [](Recording& r) {
        for_each_image(r, [](cv::Mat& image) { compress(image, 40); });
        r.calibration.right.cy += 1.5;
    });
    CHECK(found_in(diagnosis) == "compression rows");
    const auto finding = std::find_if(diagnosis.findings.begin(), diagnosis.findings.end(),
                                      [](const Finding& each) { return each.id == "compression"; });
    CHECK_MESSAGE(finding->what.find("strongly compressed") != std::string::npos, finding->what);
    CHECK(finding->severity == Severity::kWarning);
}

TEST_CASE("a view that is late, and which images to leave out: the first ones of that view") {
    const auto leave_out = [](std::vector<cv::Mat>& first, std::vector<cv::Mat>& last, int count) {
        first.erase(first.begin(), first.begin() + count);
        last.erase(last.end() - count, last.end());
    };
    for (const int frames : {1, 2}) {
        CAPTURE(frames);
        const Spoil late = [&](Recording& r) { leave_out(r.left, r.right, frames); };
        const Diagnosis right = diagnose_spoiled("heartbeat", late);
        CHECK(found_in(right) == "lag");
        CHECK(finding_of(right, "lag").value == frames);
        CHECK_SAYS(finding_of(right, "lag").what, frames == 1 ? "1 frame late" : "2 frames late");
        const std::string images = frames == 1 ? "image" : "2 images";
        const std::string lasts = frames == 1 ? "the last one" : "the last 2";
        CHECK_SAYS(finding_of(right, "lag").remedy, "the first " + images + " of the right view");
        CHECK_SAYS(finding_of(right, "lag").remedy, lasts + " of the left, so that both have");
        CHECK(found("heartbeat", [&](Recording& r) {
                  late(r);
                  leave_out(r.right, r.left, frames);
              }) == "");
        const Diagnosis left = diagnose_spoiled(
            "heartbeat", [&](Recording& r) { leave_out(r.right, r.left, frames); });
        CHECK(found_in(left) == "lag");
        CHECK(finding_of(left, "lag").value == -frames);
        CHECK_SAYS(finding_of(left, "lag").remedy, "the first " + images + " of the left view");
    }
}

TEST_CASE("first images are left out of the late view where the lag is whole and constant alone") {
    Evidence evidence;
    evidence.probe.has_rig = true;
    evidence.probe.frames.assign(12, {DEFREC_DEGRADED, DEFREC_REASON_VIEW_LATE, -0.9f, 1, true});
    // Rows tell nothing of it.
    CHECK_SAYS(look_at_lag(evidence).remedy, "leave out the first image of the left view");
    evidence.pairings = {{-1, 0.05, true}, {0, 0.06, true}, {1, 0.05, true}};
    CHECK_SAYS(look_at_lag(evidence).remedy, "leave out the first image of the left view");
    // It begins later: in some of the frames rows agree as they are.
    evidence.pairings = {{-1, 0.5, false}, {0, 0.6, true}, {1, 1.1, false}};
    CHECK_SAYS(look_at_lag(evidence).remedy, "does not mend it");
    evidence.pairings.clear();
    for (TrackedFrame& frame : evidence.probe.frames) frame.view_lag_frames = 0.5f;
    CHECK_SAYS(look_at_lag(evidence).what, "0.5 frames late");
    CHECK_SAYS(look_at_lag(evidence).remedy, "may be 1 frame, or part of one: try it");
}

TEST_CASE(
    "where the tracker's lag is between two numbers, rows tell which, or both are to be tried") {
    Evidence evidence;
    evidence.probe.has_rig = true;
    evidence.probe.frames.assign(12, {DEFREC_DEGRADED, DEFREC_REASON_VIEW_LATE, 1.5f, 1, true});
    CHECK_SAYS(look_at_lag(evidence).remedy, "may be 1 or 2 frames: try both");
    // Motion is steady, so that rows differ nearly alike in all frames.
    evidence.pairings = {
        {0, 0.12, true, 0.3}, {1, 0.1, true, 0.16}, {2, 0.07, true, 0.07}, {3, 0.11, true, 0.16}};
    CHECK(look_at_lag(evidence).value == 2);
    CHECK_SAYS(look_at_lag(evidence).remedy, "leave out the first 2 images of the right view");
    evidence.pairings[1].row_error_px = 0.09;
    CHECK_SAYS(look_at_lag(evidence).remedy, "may be 1 or 2 frames: try both");
}

TEST_CASE("other pairings are taken where rows agree in each frame, and clearly better") {
    std::vector<Pairing> pairings = {{-1, 2.0, false}, {0, 1.0, true}, {1, 0.1, true}};
    REQUIRE(better_pairing(pairings) != nullptr);
    CHECK(better_pairing(pairings)->later == 1);
    CHECK_FALSE(is_of_no_pairing(pairings));
    pairings[2].is_never_worse = false;
    CHECK(better_pairing(pairings) == nullptr);
    CHECK(is_of_no_pairing(pairings));
    pairings[2] = {1, 0.7, true};
    CHECK(better_pairing(pairings) == nullptr);
    CHECK(better_pairing({}) == nullptr);
    CHECK_FALSE(is_of_no_pairing({}));
}

TEST_CASE("rows that differ otherwise from frame to frame are not laid to the calibration alone") {
    Evidence evidence;
    evidence.width = 640;
    evidence.height = 360;
    evidence.trials.emplace_back();
    evidence.trials.front().front_share = 1;
    const auto add = [&](int pair, double step) {
        for (int i = 0; i < 40; ++i)
            evidence.trials.front().matches.push_back(
                {10.0 * (i % 8), 10.0 * (i / 8), step, 20, 80, pair});
    };
    add(0, 2);
    add(1, 2.1);
    CHECK_SAYS(look_at_rows(evidence).remedy, "Calibrate anew");
    add(2, 3);
    const Finding rows = look_at_rows(evidence);
    CHECK_SAYS(rows.what, "from 2.0 to 3.0 px, which no calibration does");
    CHECK(rows.remedy.find("Calibrate anew") == std::string::npos);
}

TEST_CASE("a lag is unknown where the tracker measures none") {
    Evidence evidence;
    evidence.probe.has_rig = true;
    evidence.probe.frames.assign(12, {DEFREC_TRACKING, DEFREC_REASON_UNCHECKED, 0, 1, false});
    CHECK(look_at_lag(evidence).verdict == Verdict::kUnknown);
    evidence.probe.frames.back().has_rows = true;
    CHECK(look_at_lag(evidence).verdict == Verdict::kFine);
}

TEST_CASE("rows that disagree") {
    CHECK(found("heartbeat", [](Recording& r) { r.calibration.right.cy += 2; }) == "rows");
}

TEST_CASE("rows that disagree by what degrades frames, and no more, are a warning") {
    const Diagnosis diagnosis =
        diagnose_spoiled("heartbeat", [](Recording& r) { r.calibration.right.cy += 0.5; });
    CHECK(found_in(diagnosis) == "rows");
    Finding rows;
    for (const Finding& finding : diagnosis.findings)
        if (finding.id == "rows") rows = finding;
    CHECK(rows.verdict == Verdict::kFound);
    CHECK(rows.severity == Severity::kWarning);
    CHECK(rows.what.find("Frames are tracked, degraded") != std::string::npos);
}

TEST_CASE("rows that the tracker finds to disagree are a warning, whatever the matches say") {
    Evidence evidence;
    evidence.width = 640;
    evidence.height = 360;
    evidence.probe.has_rig = true;
    evidence.probe.frames.assign(10, {DEFREC_TRACKING, 0, 0, 1, true});
    evidence.trials.emplace_back();
    evidence.trials.front().front_share = 1;
    for (int i = 0; i < 40; ++i)
        evidence.trials.front().matches.push_back({10.0 * (i % 8), 10.0 * (i / 8), 0.38, 20, 80});
    CHECK(look_at_rows(evidence).verdict == Verdict::kFine);
    for (int i = 0; i < 3; ++i) {
        evidence.probe.frames[i].state = DEFREC_DEGRADED;
        evidence.probe.frames[i].reasons = DEFREC_REASON_CALIBRATION;
    }
    const Finding rows = look_at_rows(evidence);
    CHECK(rows.verdict == Verdict::kFound);
    CHECK(rows.severity == Severity::kWarning);
    CHECK_SAYS(rows.what, "differ by 0.38 px");
    CHECK_SAYS(rows.what, "The tracker says so of 3 of 10 frames.");
    CHECK_SAYS(rows.remedy, "may help");
}

TEST_CASE("a surface that is lost is told with the reasons and with what helps") {
    Evidence evidence;
    evidence.probe.has_rig = true;
    evidence.probe.frames.assign(17, {DEFREC_TRACKING, DEFREC_REASON_FEW_MATCHES, 0, 1, true});
    const auto lose = [&](std::size_t first, std::size_t last, std::uint32_t reasons) {
        for (std::size_t i = first; i <= last; ++i)
            evidence.probe.frames[i] = {DEFREC_LOST, reasons, 0, 0, false};
    };
    lose(4, 6, DEFREC_REASON_LOW_CONTRAST);
    CHECK(look_at_followed(evidence).verdict == Verdict::kFine);
    lose(7, 12, DEFREC_REASON_LOW_CONTRAST | DEFREC_REASON_FEW_MATCHES);
    lose(13, 15, DEFREC_REASON_FEW_MATCHES);
    const Finding followed = look_at_followed(evidence);
    CHECK(followed.verdict == Verdict::kFound);
    CHECK(followed.severity == Severity::kError);
    CHECK(followed.what ==
          "in 12 of 17 frames the surface was lost: smoke, blur, a wet or covered lens (9); little "
          "of the "
          "tissue is recognised (3).");
    CHECK_SAYS(followed.remedy, "Clean the lens, let the smoke clear. Move the camera back to");
    CHECK_SAYS(followed.remedy, "where frames of the recording are left out");
    // Black frames are another finding's.
    evidence.probe.frames.assign(17, {DEFREC_LOST, DEFREC_REASON_DARK, 0, 0, false});
    CHECK(look_at_followed(evidence).verdict == Verdict::kUnknown);
}

TEST_CASE("disparities that are not searched") {
    const TestFolder folder;
    const std::string config = folder.write("config.yaml", "disparities: 16\n");
    CHECK(found("heartbeat", as_it_is, [&](DoctorOptions& options) {
              options.probe.config = config;
          }) == "disparity_range");
}

TEST_CASE("views that share half of what they see") {
    CHECK(found("heartbeat", [](Recording& r) {
              const int width = r.calibration.width * 6 / 10;
              const int aside = r.calibration.width - width;
              crop(r.left, 0, width);
              crop(r.right, aside, width);
              r.calibration.right.cx -= aside;
              r.calibration.width = width;
          }) == "overlap");
}

TEST_CASE("images that were magnified") {
    const Diagnosis diagnosis = diagnose_spoiled("heartbeat", [](Recording& r) {
        const int width = r.calibration.width / 2, height = r.calibration.height / 2;
        const cv::Rect middle(width / 2, height / 2, width, height);
        for_each_image(r, [&](cv::Mat& image) {
            cv::resize(image(middle), image, {}, 4, 4, cv::INTER_CUBIC);
        });
        for (CameraCalibration* camera : {&r.calibration.left, &r.calibration.right}) {
            camera->cx -= middle.x;
            camera->cy -= middle.y;
        }
        scale_calibration(r.calibration, 4);
        r.calibration.width = 4 * width;
        r.calibration.height = 4 * height;
    });
    CHECK(found_in(diagnosis) == "sharpness");
    CHECK(diagnosis_text(diagnosis).find("no detail finer than 4 px") != std::string::npos);
    CHECK(diagnosis_text(diagnosis).find("resize the images to a quarter") != std::string::npos);
}

TEST_CASE("one view twice, and views of two things") {
    CHECK(found("heartbeat", [](Recording& r) { r.right = r.left; }) == "one_view_twice");
    CHECK(found("heartbeat", [](Recording& r) { r.right = rendered("respiration").right; }) ==
          "common_content");
}

TEST_CASE("a calibration that is refused for another reason") {
    const Diagnosis diagnosis =
        diagnose_spoiled("heartbeat", [](Recording& r) { rotation_of(r.calibration)(0, 0) = 1.2; });
    CHECK(found_in(diagnosis) == "calibration");
    CHECK_SAYS(finding_of(diagnosis, "calibration").what, "R is not a rotation");
}

TEST_CASE("the last line says that nothing was found, or warnings alone") {
    Diagnosis diagnosis;
    diagnosis.frames = 40;
    diagnosis.findings.resize(3);
    for (Finding& finding : diagnosis.findings) finding.verdict = Verdict::kFine;
    const auto last_line = [&] {
        const std::string text = diagnosis_text(diagnosis);
        return text.substr(text.rfind('\n', text.size() - 2) + 1);
    };
    CHECK(last_line() == "Nothing found: 3 things looked at in 40 frames.\n");
    diagnosis.findings[0].verdict = Verdict::kUnknown;
    CHECK(last_line() ==
          "Nothing found, as far as could be seen: 3 things looked at in 40 frames, 1 unknown.\n");
    diagnosis.findings[1].verdict = Verdict::kFound;
    diagnosis.findings[1].severity = Severity::kWarning;
    CHECK(last_line() ==
          "It can be tracked, less well than it could: 3 things looked at in 40 frames, 1 warning, "
          "1 unknown.\n");
}

TEST_CASE("text and JSON say what was found, what to do and what was measured") {
    const Diagnosis diagnosis =
        diagnose_spoiled("heartbeat", [](Recording& r) { std::swap(r.left, r.right); });
    CHECK(diagnosis_text(diagnosis).find("order of the views: the views look exchanged") !=
          std::string::npos);
    CHECK(diagnosis_text(diagnosis).find("\nMend what is a problem before tracking: ") !=
          std::string::npos);
    CHECK(diagnosis_text(diagnosis).find(" frames, 1 problem, ") != std::string::npos);
    const auto json = nlohmann::json::parse(diagnosis_json(diagnosis));
    CHECK(json["found"] == 1);
    for (const auto& finding : json["findings"]) {
        CAPTURE(finding.dump());
        CHECK((finding["remedy"] == "") == (finding["verdict"] != "found"));
        if (finding["id"] != "order") continue;
        CHECK(finding["severity"] == "error");
        CHECK(finding["value"].get<double>() < 10);
        CHECK(finding["unit"] == "%");
    }
}
