// The scenes that are hard because of the picture or the rig, checked from their files.
#include "sdk/cli/render/picture_scenes.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/cli/render/written_sequence.hpp"

namespace {

using defrec::cli::match;
using defrec::cli::median;
using defrec::cli::SceneSetting;
using defrec::cli::TruthRow;
using defrec::cli::Written;

using Settings = std::vector<SceneSetting>;

/// Where the right image of a frame shows points, against where a right view of `time` would.
struct Seen {
    cv::Point2d expected, offset;  ///< px
};

/// Searches the right image for what the left view saw at `time`, a frame with tissue.
std::vector<Seen> seen_in_right(const Written& w, int frame, int time) {
    const cv::Mat left = w.rectified("left", time), right = w.rectified("right", frame);
    std::vector<Seen> found;
    for (const TruthRow& row : w.truth[static_cast<std::size_t>(time)]) {
        const cv::Point3d pixel = w.in_rectified(row.point);
        const cv::Point2d expected(pixel.x - pixel.z, pixel.y);
        cv::Point2d offset;
        if (row.visible && match(left, {pixel.x, pixel.y}, right, expected, 6, offset)) {
            found.push_back({expected, offset});
        }
    }
    REQUIRE(found.size() >= 30);
    return found;
}

double median_of(const std::vector<Seen>& seen, double (*value)(const Seen&)) {
    std::vector<double> values;
    values.reserve(seen.size());
    for (const Seen& s : seen) {
        values.push_back(value(s));
    }
    return median(values);
}

double distance(const Seen& s) { return cv::norm(s.offset); }

/// px by which the median point moves between two frames, along and across.
cv::Point2d moved(const Written& w, std::size_t from, std::size_t to) {
    std::vector<double> along, across;
    for (std::size_t id = 0; id < w.points.size(); ++id) {
        const cv::Point3d step =
            w.in_rectified(w.truth[to][id].point) - w.in_rectified(w.truth[from][id].point);
        along.push_back(std::abs(step.x));
        across.push_back(std::abs(step.y));
    }
    return {median(along), median(across)};
}

/// dy = offset + roll (x - cx) + scale (y - cy), least squares without gross errors.
struct Misalignment {
    double offset, roll, scale;
};

Misalignment misalignment(const Written& w, int frame) {
    std::vector<Seen> seen = seen_in_right(w, frame, frame);
    const double middle = median_of(seen, [](const Seen& s) { return s.offset.y; });
    const cv::Point2d centre(w.p2.at<double>(0, 2), w.p2.at<double>(1, 2));
    cv::Mat a, b;
    for (const Seen& s : seen) {
        if (std::abs(s.offset.y - middle) < 2.5) {
            const cv::Point2d at = s.expected - centre;
            a.push_back(cv::Mat(cv::Matx13d(1, at.x, at.y)));
            b.push_back(s.offset.y);
        }
    }
    cv::Mat solution;
    cv::solve(a, b, solution, cv::DECOMP_QR);
    return {solution.at<double>(0), solution.at<double>(1), solution.at<double>(2)};
}

}  // namespace

TEST_CASE("a late right view shows the tissue where it was, the truth stays that of the left") {
    double lag = 1;
    SUBCASE("late") {}
    SUBCASE("early") { lag = -1; }
    const Written w("late-view", 480, 270, 10, false, 1, 2, {{"lag", lag}});
    for (const int frame : {3, 4}) {
        CAPTURE(frame);
        const int time = frame - static_cast<int>(lag);
        CHECK(median_of(seen_in_right(w, frame, time), distance) < 0.2);
        const cv::Point2d step =
            moved(w, static_cast<std::size_t>(frame), static_cast<std::size_t>(time));
        CHECK(std::max(step.x, step.y) > 2);
        CHECK(std::min(step.x, step.y) > 0.5);
    }
    for (const int frame : {2, 5}) {
        CAPTURE(frame);
        CHECK(median_of(seen_in_right(w, frame, frame), distance) < 0.2);
    }
}

TEST_CASE("a right view late by half a frame shows the tissue between two frames") {
    const Written w("late-view", 480, 270, 10, false, 1, 2,
                    {{"lag", 0.5}, {"from", 0.4}, {"to", 0.5}});
    const auto against = [&](int time) {
        const std::vector<Seen> seen = seen_in_right(w, 4, time);
        return cv::Point2d(median_of(seen, [](const Seen& s) { return s.offset.x; }),
                           median_of(seen, [](const Seen& s) { return s.offset.y; }));
    };
    const cv::Point2d before = against(3), after = against(4);
    CHECK(cv::norm(before) > 1);
    CHECK(cv::norm(before + after) < 0.3 * cv::norm(before));
}

TEST_CASE("a misaligned right view is low, rolled and enlarged by what the scene says") {
    SUBCASE("by default, from the first frame, after JPEG") {
        const Written w("misaligned", 480, 270, 1);
        const Misalignment m = misalignment(w, 0);
        CHECK(m.offset == doctest::Approx(1.2).epsilon(0.05));
        CHECK(m.roll == doctest::Approx(0.15 * CV_PI / 180).epsilon(0.1));
        CHECK(std::abs(m.scale) < 3e-4);
    }
    SUBCASE("other values") {
        const Written w("misaligned", 480, 270, 1, false, 1, 2,
                        {{"offset_px", -2}, {"roll_deg", -0.4}, {"focal_ratio", 1.01}});
        const Misalignment m = misalignment(w, 0);
        CHECK(m.offset == doctest::Approx(-2).epsilon(0.05));
        CHECK(m.roll == doctest::Approx(-0.4 * CV_PI / 180).epsilon(0.05));
        CHECK(m.scale == doctest::Approx(0.01).epsilon(0.05));
    }
    SUBCASE("drifting") {
        const Written w("misaligned", 480, 270, 5, false, 1, 2, {{"drift", 1}});
        for (const int frame : {0, 2, 4}) {
            CAPTURE(frame);
            CHECK(std::abs(misalignment(w, frame).offset - 0.3 * frame) < 0.06);
        }
    }
}

TEST_CASE("the misaligned right view has its own exposure and gamma, both views lose to JPEG") {
    const auto rendered = [](double exposure, double gamma, double quality) {
        return Written("misaligned", 320, 180, 1, false, 1, 2,
                       {{"exposure", exposure}, {"gamma", gamma}, {"quality", quality}});
    };
    const auto mean_light = [](const cv::Mat& image) {
        cv::Mat green, light;
        cv::extractChannel(image, green, 1);
        green.convertTo(light, CV_64F, 1.0 / 255);
        cv::pow(light, 2.2, light);
        // Without the highlights, which are saturated.
        return cv::mean(light, green < 200)[0];
    };
    const Written plain = rendered(1, 1, 0), bright = rendered(1.2, 1, 0),
                  steep = rendered(1, 1.3, 0), coarse = rendered(1, 1, 15);
    const cv::Mat right = plain.image("right", 0);
    CHECK(mean_light(bright.image("right", 0)) / mean_light(right) ==
          doctest::Approx(1.2).epsilon(0.03));
    CHECK(cv::norm(bright.image("left", 0), plain.image("left", 0), cv::NORM_INF) == 0);
    cv::Mat expected;
    right.convertTo(expected, CV_64F, 1.0 / 255);
    cv::pow(expected, 1.3, expected);
    CHECK(std::abs(255 * cv::mean(expected)[1] - cv::mean(steep.image("right", 0))[1]) < 2);
    for (const char* view : {"left", "right"}) {
        const double psnr = cv::PSNR(coarse.image(view, 0), plain.image(view, 0));
        CHECK(psnr > 24);
        CHECK(psnr < 36);
    }
}
