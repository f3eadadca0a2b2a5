// The scenes that are hard because of the picture or the rig, checked from their files.
#include "sdk/scenes/picture_scenes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "sdk/scenes/writing/written_sequence.hpp"

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

/// Contrast of vessels and spots, but not of highlights: gray levels.
double detail_in(const cv::Mat& bgr) {
    cv::Mat gray, fine;
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    gray.convertTo(gray, CV_64F);
    cv::GaussianBlur(gray, gray, {}, 1.0);
    cv::Laplacian(gray, fine, CV_64F);
    std::vector<double> values;
    for (auto value = fine.begin<double>(); value != fine.end<double>(); ++value) {
        values.push_back(std::abs(*value));
    }
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 9 / 10);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

double detail(const Written& w, int frame) { return detail_in(w.image("left", frame)); }

/// In a window round a pixel.
double detail_at(const Written& w, int frame, cv::Point2d centre) {
    constexpr int kHalf = 12;
    const cv::Mat image = w.image("left", frame);
    const cv::Rect window(static_cast<int>(centre.x) - kHalf, static_cast<int>(centre.y) - kHalf,
                          2 * kHalf, 2 * kHalf);
    return detail_in(image(window & cv::Rect({0, 0}, image.size())));
}

/// px by which one sequence's image of a frame is moved against the other's.
std::vector<double> displacements(const Written& a, const Written& b, const char* view, int frame) {
    const cv::Mat from = a.rectified(view, frame), to = b.rectified(view, frame);
    std::vector<double> found;
    for (const cv::Point2d& centre : a.points) {
        cv::Point2d offset;
        if (match(from, centre, to, centre, 4, offset)) {
            found.push_back(cv::norm(offset));
        }
    }
    REQUIRE(found.size() >= 30);
    return found;
}

}  // namespace

TEST_CASE("a late right view shows the tissue where it was, the truth stays that of the left") {
    double lag = 1;
    SUBCASE("late") {}
    SUBCASE("early") { lag = -1; }
    const Written w({.scene = "late-view",
                     .settings = {{"lag", lag}},
                     .width = 384,
                     .height = 216,
                     .frames = 10});
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
    const Written w({.scene = "late-view",
                     .settings = {{"lag", 0.5}, {"from", 0.4}, {"to", 0.5}},
                     .width = 480,
                     .height = 270,
                     .frames = 10});
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
        const Written w({.scene = "misaligned", .width = 480, .height = 270, .frames = 1});
        const Misalignment m = misalignment(w, 0);
        CHECK(m.offset == doctest::Approx(1.2).epsilon(0.05));
        CHECK(m.roll == doctest::Approx(0.15 * CV_PI / 180).epsilon(0.1));
        CHECK(std::abs(m.scale) < 3e-4);
    }
    SUBCASE("other values") {
        const Written w({.scene = "misaligned",
                         .settings = {{"offset_px", -2}, {"roll_deg", -0.4}, {"focal_ratio", 1.01}},
                         .width = 480,
                         .height = 270,
                         .frames = 1});
        const Misalignment m = misalignment(w, 0);
        CHECK(m.offset == doctest::Approx(-2).epsilon(0.05));
        CHECK(m.roll == doctest::Approx(-0.4 * CV_PI / 180).epsilon(0.05));
        CHECK(m.scale == doctest::Approx(0.01).epsilon(0.05));
    }
    SUBCASE("drifting") {
        const Written w({.scene = "misaligned",
                         .settings = {{"drift", 1}},
                         .width = 480,
                         .height = 270,
                         .frames = 5});
        for (const int frame : {0, 2, 4}) {
            CAPTURE(frame);
            CHECK(std::abs(misalignment(w, frame).offset - 0.3 * frame) < 0.06);
        }
    }
}

TEST_CASE("tissue moves sideways at the scene's angle and speed, in a right view that is turned") {
    constexpr double kAngle = 20, kSpeed = 0.4, kTurn = 0.5;
    const Written w({.scene = "sideways",
                     .settings = {{"angle", kAngle},
                                  {"speed", kSpeed},
                                  {"phase", 0.25},
                                  {"lag", 0},
                                  {"vergence_deg", kTurn}},
                     .width = 480,
                     .height = 270,
                     .frames = 2});
    const cv::Point3d step =
        w.in_rectified(w.truth[1][0].point) - w.in_rectified(w.truth[0][0].point);
    const double baseline = -w.p2.at<double>(0, 3) / w.p2.at<double>(0, 0),
                 mm_per_px = baseline / w.in_rectified(w.truth[0][0].point).z;
    CHECK(mm_per_px * std::hypot(step.x, step.y) == doctest::Approx(kSpeed).epsilon(0.05));
    CHECK(std::atan2(step.y, step.x) == doctest::Approx(kAngle * CV_PI / 180).epsilon(0.01));
    CHECK(std::abs(step.z) < 1e-6);
    std::vector<double> turned;
    for (const Seen& seen : seen_in_right(w, 0, 0)) {
        const double f = w.p2.at<double>(0, 0), x = (seen.expected.x - w.p2.at<double>(0, 2)) / f;
        turned.push_back(seen.offset.x / (f * (1 + x * x)));
    }
    CHECK(median(turned) == doctest::Approx(kTurn * CV_PI / 180).epsilon(0.05));
}

TEST_CASE("the misaligned right view has its own exposure and gamma, both views lose to JPEG") {
    const auto rendered = [](double exposure, double gamma, double quality) {
        return Written(
            {.scene = "misaligned",
             .settings = {{"exposure", exposure}, {"gamma", gamma}, {"quality", quality}},
             .width = 320,
             .height = 180,
             .frames = 1});
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

TEST_CASE(
    "blood spreads to its share of the view; what lies under it is hidden and without depth") {
    const Written w({.scene = "blood", .width = 384, .height = 216, .frames = 10, .depth = true});
    // Blood is darker or more saturated than tissue, except in highlights.
    const auto is_blood = [](const cv::Vec3d& bgr) {
        return bgr[2] < 108 || bgr[2] > 2.05 * bgr[1];
    };
    int hidden = 0, visible = 0, wrong = 0;
    for (const int frame : {0, 4, 9}) {
        const cv::Mat image = w.image("left", frame);
        for (const TruthRow& row : w.truth[static_cast<std::size_t>(frame)]) {
            const cv::Point2d pixel = w.in_raw(row.point);
            if (!cv::Rect2d(4, 4, image.cols - 8, image.rows - 8).contains(pixel)) {
                continue;
            }
            cv::Mat patch;
            cv::getRectSubPix(image, {5, 5}, cv::Point2f(pixel), patch);
            const cv::Scalar colour = cv::mean(patch);
            const bool shines = colour[0] > 90;
            ++(row.visible ? visible : hidden);
            wrong += row.visible == is_blood({colour[0], colour[1], colour[2]}) && !shines ? 1 : 0;
        }
        if (frame == 0) {
            CHECK(hidden == 0);
        }
    }
    CHECK(hidden > 100);
    CHECK(visible > 300);
    CHECK(wrong < (hidden + visible) / 20);

    const cv::Mat image = w.image("left", 9);
    const cv::Mat disparity =
        cv::imread((w.folder.path / "disparity/000009.png").string(), cv::IMREAD_UNCHANGED);
    REQUIRE(disparity.size() == w.size);
    int blood = 0, saturated_red = 0, tissue_depth = 0, blood_depth = 0;
    for (int v = 0; v < image.rows; ++v) {
        for (int u = 0; u < image.cols; ++u) {
            const cv::Vec3b& bgr = image.at<cv::Vec3b>(v, u);
            const bool known = disparity.at<std::uint16_t>(v, u) > 0;
            const bool dark = is_blood(bgr);
            blood += dark ? 1 : 0;
            tissue_depth += !dark && known ? 1 : 0;
            // Surely blood.
            const bool red = bgr[2] > 2.3 * bgr[1];
            saturated_red += red ? 1 : 0;
            blood_depth += red && known ? 1 : 0;
        }
    }
    CHECK(blood > 0.4 * w.size.area());
    CHECK(blood < 0.6 * w.size.area());
    CHECK(saturated_red > 0.1 * w.size.area());
    CHECK(blood_depth < 0.02 * saturated_red);
    CHECK(tissue_depth > 0.7 * (w.size.area() - blood));
}

TEST_CASE("heavy smoke is another cloud every four frames, and takes most of the contrast") {
    const Written w({.scene = "heavy-smoke", .width = 240, .height = 136, .frames = 20});
    const auto coarse = [&](int frame) {
        cv::Mat small;
        cv::resize(w.image("left", frame), small, {12, 7}, 0, 0, cv::INTER_AREA);
        return small;
    };
    double within = 0, between = 255;
    for (int frame = 5; frame < 20; ++frame) {
        const double step =
            cv::norm(coarse(frame), coarse(frame - 1), cv::NORM_L1) / (3.0 * 12 * 7);
        double& bound = frame % 4 == 0 ? between : within;
        bound = frame % 4 == 0 ? std::min(between, step) : std::max(within, step);
    }
    CHECK(between > 1.5 * within);
    const Written clear({.scene = "heavy-smoke",
                         .settings = {{"density", 0}},
                         .width = 240,
                         .height = 136,
                         .frames = 20});
    double least = 1;
    for (int frame = 4; frame < 20; frame += 4) {
        least = std::min(least, detail(w, frame) / detail(clear, frame));
    }
    CHECK(least < 0.6);
}

TEST_CASE("H.264 loses detail, the more the lower its rate, and moves nothing") {
    const auto rendered = [](double contrast) {
        return Written({.scene = "compressed",
                        .settings = {{"contrast", contrast}},
                        .width = 321,
                        .height = 181,
                        .frames = 6});
    };
    const Written plain = rendered(0), good = rendered(1), poor = rendered(0.4);
    CHECK(detail(good, 5) < 0.95 * detail(plain, 5));
    CHECK(cv::PSNR(good.image("right", 5), plain.image("right", 5)) >
          cv::PSNR(poor.image("right", 5), plain.image("right", 5)) + 2);
    CHECK(median(displacements(plain, good, "left", 5)) < 0.25);
    CHECK(median(displacements(plain, good, "right", 5)) < 0.25);
    CHECK_FALSE(std::filesystem::exists(good.folder.path / "left.mp4"));
    CHECK(std::distance(std::filesystem::directory_iterator(good.folder.path), {}) == 5);
}

TEST_CASE("motion blur takes detail, keeps the light, and is centred on the truth") {
    const auto rendered = [](double shutter) {
        return Written({.scene = "motion-blur",
                        .settings = {{"shutter", shutter}, {"speed", 1.25}},
                        .width = 384,
                        .height = 216,
                        .frames = 6});
    };
    const Written sharp = rendered(0), blurred = rendered(1);
    int much = 0;
    for (int frame = 0; frame < 6; ++frame) {
        CAPTURE(frame);
        CHECK(median(displacements(sharp, blurred, "left", frame)) < 0.3);
        CHECK(cv::mean(blurred.image("left", frame))[1] ==
              doctest::Approx(cv::mean(sharp.image("left", frame))[1]).epsilon(0.02));
        much += detail(blurred, frame) < 0.7 * detail(sharp, frame) ? 1 : 0;
    }
    CHECK(much >= 2);
}

TEST_CASE("highlights wander over the tissue, the more the glossier it is") {
    const auto shining = [](const Written& w, std::size_t frame) {
        const cv::Mat image = w.image("left", static_cast<int>(frame));
        std::vector<bool> result;
        for (const TruthRow& row : w.truth[frame]) {
            const cv::Point pixel(w.in_raw(row.point));
            result.push_back(row.visible && image.at<cv::Vec3b>(pixel)[0] > 200);
        }
        return result;
    };
    const auto saturated = [](const Written& w) {
        std::vector<cv::Mat> channels;
        cv::split(w.image("left", 0), channels);
        return cv::countNonZero(channels[0] > 200) / static_cast<double>(w.size.area());
    };
    const Written w({.scene = "headlight", .width = 384, .height = 216, .frames = 9});
    const std::vector<bool> before = shining(w, 0), after = shining(w, 8);
    int stays = 0, goes = 0;
    for (std::size_t id = 0; id < before.size(); ++id) {
        stays += before[id] && after[id] ? 1 : 0;
        goes += before[id] != after[id] ? 1 : 0;
    }
    CHECK(goes > 8);
    CHECK(goes > 2 * stays);
    CHECK(saturated(w) > 0.03);
    CHECK(saturated(Written({.scene = "headlight",
                             .settings = {{"gloss", 0}},
                             .width = 384,
                             .height = 216,
                             .frames = 1})) < 0.001);
}

TEST_CASE("defocus grows with the distance from the focus, which moves") {
    const auto rendered = [](const Settings& settings, int frames = 10) {
        return Written({.scene = "defocus",
                        .settings = settings,
                        .width = 480,
                        .height = 270,
                        .frames = frames});
    };
    const Written sharp = rendered({{"aperture", 0}}), moving = rendered({{"aperture", 6}});
    // The focus is in the middle of the tissue in frame 0 and farthest from it in frame 9.
    CHECK(detail(moving, 0) > 0.6 * detail(sharp, 0));
    CHECK(detail(moving, 9) < 0.65 * detail(sharp, 9));
    CHECK(median(displacements(sharp, moving, "right", 9)) < 0.2);

    const Written near = rendered({{"aperture", 6}, {"focus", -8}, {"breathing", 0}}, 1);
    std::vector<double> depth;
    for (const TruthRow& row : near.truth[0]) {
        depth.push_back(row.point.z);
    }
    const double middle = median(depth);
    const auto kept = [&](bool far) {
        std::vector<double> shares;
        for (std::size_t id = 0; id < near.points.size(); ++id) {
            if ((near.truth[0][id].point.z > middle) == far) {
                shares.push_back(detail_at(near, 0, near.points[id]) /
                                 detail_at(sharp, 0, near.points[id]));
            }
        }
        return median(shares);
    };
    CHECK(kept(false) > 1.1 * kept(true));
}

TEST_CASE("a sheen covers a tenth of the view, elsewhere in each view and frame") {
    const auto shine = [](const Written& w, const char* view, int frame) {
        cv::Mat channels[3];
        cv::split(w.image(view, frame), channels);
        return cv::Mat(cv::min(cv::min(channels[0], channels[1]), channels[2]) > 200);
    };
    const auto rendered = [](const Settings& settings, int frames) {
        return Written({.scene = "sheen",
                        .settings = settings,
                        .width = 320,
                        .height = 180,
                        .frames = frames});
    };
    const Written w = rendered({}, 20);
    const auto share = [&](const cv::Mat& mask) {
        return cv::countNonZero(mask) / static_cast<double>(w.size.area());
    };
    double mean = 0;
    for (int frame = 0; frame < 20; ++frame) mean += share(shine(w, "left", frame)) / 20;
    CHECK(mean > 0.05);
    CHECK(mean < 0.15);
    const Written dull = rendered({{"gloss", 0}}, 1);
    CHECK(share(shine(dull, "left", 0)) < 0.005);

    int goes = 0, stays = 0;
    const cv::Mat first = shine(w, "left", 0), last = shine(w, "left", 19);
    for (std::size_t id = 0; id < w.points.size(); ++id) {
        const cv::Point before(w.in_raw(w.truth[0][id].point)),
            after(w.in_raw(w.truth[19][id].point));
        if (!w.truth[19][id].visible) continue;
        const bool shone = first.at<std::uint8_t>(before) != 0,
                   shines = last.at<std::uint8_t>(after) != 0;
        goes += shone != shines ? 1 : 0;
        stays += shone && shines ? 1 : 0;
    }
    CHECK(goes > stays);

    // It lies behind the tissue, as what is mirrored does: its disparity is smaller.
    const auto middle = [](const cv::Mat& mask) {
        const cv::Moments m = cv::moments(mask, true);
        return m.m10 / m.m00;
    };
    std::vector<double> disparities;
    for (const TruthRow& row : w.truth[0]) disparities.push_back(w.in_rectified(row.point).z);
    const double of_shine = middle(first) - middle(shine(w, "right", 0));
    CHECK(of_shine < median(disparities) - 2);

    const Written flowing = rendered({{"film", 1}}, 5), still = rendered({}, 5);
    CHECK(cv::norm(flowing.image("left", 0), still.image("left", 0), cv::NORM_INF) == 0);
    CHECK(cv::countNonZero(shine(flowing, "left", 4) != shine(still, "left", 4)) >
          0.1 * cv::countNonZero(shine(still, "left", 4)));
}

TEST_CASE("fat has little texture, little light and much noise") {
    const auto rendered = [](const Settings& settings) {
        return Written(
            {.scene = "fat", .settings = settings, .width = 320, .height = 180, .frames = 1});
    };
    const Written plain = rendered({{"noise", 0}});
    CHECK(detail(plain, 0) < 0.5 * detail(rendered({{"noise", 0}, {"contrast", 0.7}}), 0));
    CHECK(detail(rendered({}), 0) > 1.5 * detail(plain, 0));
    CHECK(cv::mean(plain.image("left", 0))[1] <
          0.75 * cv::mean(rendered({{"noise", 0}, {"light", 1}}).image("left", 0))[1]);
}
