// Reference sequences checked from their files alone, with OpenCV as the independent judge of
// geometry.
#include <doctest/doctest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "sdk/scenes/film.hpp"
#include "sdk/scenes/writing/render_command.hpp"
#include "sdk/scenes/writing/written_sequence.hpp"

#ifdef __SANITIZE_THREAD__
// GDAL, which OpenCV's imgcodecs starts, takes two of its own locks in both orders; of what FFmpeg
// and x264 do only half is seen. The name is the sanitizer's.
extern "C" __attribute__((visibility("default"))) const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
    return "race:libavcodec.so\nrace:libavutil.so\nrace:libavformat.so\nrace:libswscale.so\nrace:"
           "libx264.so\n"
           "deadlock:libgdal.so\n";
}
#endif

namespace fs = std::filesystem;
using defrec::cli::FieldOrder;
using defrec::cli::match;
using defrec::cli::median;
using defrec::cli::numbered;
using defrec::cli::RenderOptions;
using defrec::cli::RenderOutputError;
using defrec::cli::RenderUsageError;
using defrec::cli::slurp;
using defrec::cli::TemporaryFolder;
using defrec::cli::TruthRow;
using defrec::cli::Written;

namespace {

constexpr int kSharedFrames = 24;

/// The first frames of a scene, rendered once in this program.
const Written& shared(const std::string& scene, int width, int height, int frames,
                      bool depth = false) {
    static std::map<std::string, std::unique_ptr<const Written>> known;
    auto& kept = known[scene];
    if (kept == nullptr)
        kept = std::make_unique<const Written>(RenderOptions{
            .scene = scene, .width = width, .height = height, .frames = frames, .depth = depth});
    return *kept;
}
const Written& shared(const std::string& scene, bool depth = false) {
    return shared(scene, 320, 180, kSharedFrames, depth);
}
const Written& heartbeat() { return shared("heartbeat", 480, 270, 3); }
const Written& respiration() { return shared("respiration", 480, 270, 4); }
const Written& lobes() { return shared("lobes", 384, 216, 10); }

/// Matches every visible point of `frame` between the rectified views; the truth says where it
/// ought to be.
void check_views(const Written& w, int frame) {
    const cv::Mat left = w.rectified("left", frame), right = w.rectified("right", frame);
    std::vector<double> along, across;
    int tried = 0;
    for (const TruthRow& row : w.truth[static_cast<std::size_t>(frame)]) {
        if (!row.visible) {
            continue;
        }
        const cv::Point3d pixel = w.in_rectified(row.point);
        const cv::Rect inner(20, 20, left.cols - 40, left.rows - 40);
        if (!inner.contains(cv::Point(static_cast<int>(pixel.x), static_cast<int>(pixel.y))) ||
            pixel.x - pixel.z < 20) {
            continue;
        }
        ++tried;
        cv::Point2d offset;
        if (match(left, {pixel.x, pixel.y}, right, {pixel.x - pixel.z, pixel.y}, 4, offset)) {
            along.push_back(std::abs(offset.x));
            across.push_back(std::abs(offset.y));
        }
    }
    REQUIRE(tried >= 30);
    CHECK(static_cast<double>(along.size()) > 0.8 * tried);
    CHECK(median(along) < 0.15);
    CHECK(median(across) < 0.15);
}

/// Points of frame 0 are found in a later left image where the truth says.
void check_follows(const Written& w, int frame) {
    cv::Mat first, later;
    cv::cvtColor(w.image("left", 0), first, cv::COLOR_BGR2GRAY);
    cv::cvtColor(w.image("left", frame), later, cv::COLOR_BGR2GRAY);
    std::vector<double> error, moved;
    for (std::size_t id = 0; id < w.points.size(); ++id) {
        const TruthRow& row = w.truth[static_cast<std::size_t>(frame)][id];
        cv::Point2d offset;
        const cv::Point2d now = w.in_raw(row.point);
        if (row.visible && match(first, w.points[id], later, now, 4, offset)) {
            error.push_back(cv::norm(offset));
            moved.push_back(cv::norm(now - w.points[id]));
        }
    }
    REQUIRE(error.size() > w.points.size() / 3);
    CHECK(median(error) < 0.35);
    CHECK(median(moved) > 1.0);
}

int run_command(std::vector<std::string> arguments, const defrec::cli::StopFn& stop = {}) {
    CLI::App app("defrec");
    std::function<int()> run;
    defrec::cli::add_render_command(app, run, stop);
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
    REQUIRE(run);
    return run();
}

}  // namespace

TEST_CASE(
    "the same options give the same bits, whatever the number of threads; another seed does not") {
    const Written one({.scene = "indentation",
                       .width = 200,
                       .height = 150,
                       .frames = 2,
                       .seed = 5,
                       .depth = true,
                       .threads = 1});
    const Written three({.scene = "indentation",
                         .width = 200,
                         .height = 150,
                         .frames = 2,
                         .seed = 5,
                         .depth = true,
                         .threads = 3});
    const Written other({.scene = "indentation",
                         .width = 200,
                         .height = 150,
                         .frames = 2,
                         .seed = 6,
                         .depth = true,
                         .threads = 3});
    int files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(one.folder.path)) {
        if (entry.is_regular_file()) {
            const fs::path name = fs::relative(entry.path(), one.folder.path);
            CAPTURE(name.string());
            CHECK(slurp(entry.path()) == slurp(three.folder.path / name));
            ++files;
        }
    }
    CHECK(files == 2 * 3 + 3);
    CHECK(slurp(one.folder.path / "left/000000.png") !=
          slurp(other.folder.path / "left/000000.png"));
    CHECK(slurp(one.folder.path / "truth.csv") != slurp(other.folder.path / "truth.csv"));
}

TEST_CASE(
    "the truth of the first frame projects onto points.csv, through the distortion where there is "
    "one") {
    for (const auto& scene : defrec::cli::list_scenes()) {
        CAPTURE(scene.name);
        const Written w({.scene = scene.name, .width = 180, .height = 144, .frames = 1});
        CHECK(w.points.size() >= 60);
        const bool is_rectified = cv::norm(w.d1) == 0 && cv::norm(w.m1, w.m2) == 0 &&
                                  cv::norm(w.r, cv::Mat::eye(3, 3, CV_64F)) == 0;
        CHECK(is_rectified == scene.rectified);
        double worst = 0;
        for (std::size_t id = 0; id < w.points.size(); ++id) {
            CHECK(w.truth[0][id].visible);
            worst = std::max(worst, cv::norm(w.in_raw(w.truth[0][id].point) - w.points[id]));
        }
        CHECK(worst < 1e-4);
    }
}

TEST_CASE("both views show the tissue where the truth has it, f*B/Z apart") {
    SUBCASE("rectified") { check_views(heartbeat(), 0); }
    SUBCASE("raw, later, from a moved camera") { check_views(respiration(), 3); }
    SUBCASE("5:4") {
        check_views(Written({.scene = "stretch", .width = 360, .height = 288, .frames = 1}), 0);
    }
    SUBCASE("grasped") { check_views(shared("grasp"), 22); }
    SUBCASE("beside an open cut") { check_views(shared("cut", true), 23); }
    SUBCASE("lobes") { check_views(lobes(), 3); }
    SUBCASE("near and turned") { check_views(shared("approach"), 23); }
    SUBCASE("pinched") { check_views(shared("pinch"), 19); }
    SUBCASE("beside and on a flap") { check_views(shared("flap"), 8); }
    SUBCASE("organs in contact") { check_views(shared("shear"), 23); }
    SUBCASE("a fold") { check_views(shared("fold"), 23); }
    SUBCASE("loops") { check_views(shared("loops"), 10); }
}

TEST_CASE("both views of a microscope show the tissue where the truth has it, in the same place") {
    for (const char* scene : {"microscope", "toe-in"}) {
        CAPTURE(scene);
        const Written& w = shared(scene, 480, 270, 3);
        cv::Mat left, right;
        cv::cvtColor(w.image("left", 2), left, cv::COLOR_BGR2GRAY);
        cv::cvtColor(w.image("right", 2), right, cv::COLOR_BGR2GRAY);
        const cv::Matx33d from_rectified = cv::Mat(w.r1.t());
        cv::Vec3d turn;
        cv::Rodrigues(w.r, turn);
        std::vector<double> along, across, apart;
        int tried = 0;
        for (const TruthRow& row : w.truth[2]) {
            const cv::Point3d in_left = from_rectified * row.point;
            const cv::Point2d from = w.in_raw(row.point);
            std::vector<cv::Point2d> to;
            cv::projectPoints(std::vector<cv::Point3d>{in_left}, turn, w.t, w.m2, w.d2, to);
            if (!row.visible || !cv::Rect2d(20, 20, 440, 230).contains(to[0])) continue;
            ++tried;
            apart.push_back(std::abs(from.x - to[0].x));
            cv::Point2d offset;
            if (match(left, from, right, to[0], 4, offset)) {
                along.push_back(std::abs(offset.x));
                across.push_back(std::abs(offset.y));
            }
        }
        REQUIRE(tried >= 30);
        CHECK(static_cast<double>(along.size()) > 0.8 * tried);
        CHECK(median(along) < 0.2);
        CHECK(median(across) < 0.2);
        CHECK(median(apart) < 0.06 * 480);
        const double total = w.m1.at<double>(0, 0) * cv::norm(w.t) / 300;
        CHECK(total > 0.8 * 480);  // of disparity
    }
}

TEST_CASE("the pictures move as the truth says") {
    SUBCASE("heartbeat") { check_follows(heartbeat(), 2); }
    SUBCASE("respiration, raw") { check_follows(respiration(), 2); }
    SUBCASE("stretch") {
        check_follows(Written({.scene = "stretch", .width = 480, .height = 270, .frames = 6}), 5);
    }
    SUBCASE("grasp") { check_follows(shared("grasp"), 11); }
    SUBCASE("two instruments") { check_follows(shared("two-instruments"), 9); }
    SUBCASE("approach") { check_follows(shared("approach"), 10); }
    SUBCASE("cut") { check_follows(shared("cut", true), 23); }
    SUBCASE("lobes") { check_follows(lobes(), 7); }
    SUBCASE("roll") {
        check_follows(Written({.scene = "roll", .width = 384, .height = 216, .frames = 8}), 7);
    }
    SUBCASE("slide") {
        check_follows(Written({.scene = "slide", .width = 384, .height = 216, .frames = 15}), 14);
    }
    SUBCASE("pinch") { check_follows(shared("pinch"), 11); }
    SUBCASE("flap") { check_follows(shared("flap"), 23); }
    SUBCASE("shear") { check_follows(shared("shear"), 14); }
    SUBCASE("fold") { check_follows(shared("fold"), 9); }
    SUBCASE("loops") { check_follows(shared("loops"), 5); }
    SUBCASE("fat, with a texture that can be matched") {
        check_follows(Written({.scene = "fat",
                               .settings = {{"contrast", 0.7}, {"noise", 0}},
                               .width = 320,
                               .height = 180,
                               .frames = 9}),
                      8);
    }
}

TEST_CASE("the disparity picture is f*B/Z of the truth") {
    const Written w(
        {.scene = "indentation", .width = 320, .height = 180, .frames = 6, .depth = true});
    const cv::Mat disparity =
        cv::imread((w.folder.path / "disparity" / numbered(5)).string(), cv::IMREAD_UNCHANGED);
    REQUIRE(disparity.type() == CV_16UC1);
    REQUIRE(disparity.size() == w.size);
    int compared = 0;
    for (const TruthRow& row : w.truth[5]) {
        const cv::Point3d pixel = w.in_rectified(row.point);
        const cv::Point at(static_cast<int>(std::lround(pixel.x)),
                           static_cast<int>(std::lround(pixel.y)));
        if (row.visible && disparity.at<std::uint16_t>(at) > 0) {
            // The disparity is that of the pixel's centre, up to half a pixel from the point.
            CHECK(disparity.at<std::uint16_t>(at) / 256.0 ==
                  doctest::Approx(pixel.z).epsilon(0.01));
            ++compared;
        }
    }
    CHECK(compared > 60);
    CHECK(cv::countNonZero(disparity) > disparity.size().area() / 2);
    CHECK(cv::countNonZero(disparity) < disparity.size().area());
}

TEST_CASE("fast-cut jumps by 10 mm and more twice, and not otherwise") {
    const Written w({.scene = "fast-cut", .width = 160, .height = 120, .frames = 9});
    for (std::size_t frame = 1; frame < w.truth.size(); ++frame) {
        double minimum = 1e9, maximum = 0;
        for (std::size_t id = 0; id < w.points.size(); ++id) {
            const double step = cv::norm(w.truth[frame][id].point - w.truth[frame - 1][id].point);
            minimum = std::min(minimum, step);
            maximum = std::max(maximum, step);
        }
        CAPTURE(frame);
        if (frame == 3 || frame == 6) {
            CHECK(minimum >= 10.0);
        } else {
            CHECK(maximum < 4.0);
        }
    }
}

TEST_CASE("stretch changes distances by 30 % and more") {
    const Written w({.scene = "stretch", .width = 160, .height = 120, .frames = 25});
    double maximum = 0;
    for (std::size_t id = 1; id < w.points.size(); ++id) {
        if (w.points[id].y == w.points[id - 1].y) {
            const double before = cv::norm(w.truth[0][id].point - w.truth[0][id - 1].point);
            maximum = std::max(
                maximum, cv::norm(w.truth[24][id].point - w.truth[24][id - 1].point) / before);
        }
    }
    CHECK(maximum > 1.30);
    CHECK(maximum < 1.50);
}

TEST_CASE("pinch draws tissue together under the tip and presses it in") {
    const Written& w = shared("pinch");
    const auto& rest = w.truth[0];
    const auto& pinched = w.truth[21];
    const auto area = [](const std::vector<TruthRow>& rows, std::size_t a, std::size_t b,
                         std::size_t c) {
        return 0.5 * cv::norm((rows[b].point - rows[a].point).cross(rows[c].point - rows[a].point));
    };
    double smallest = 1, deepest = 0;
    for (std::size_t id = 0; id + 1 < w.points.size(); ++id) {
        deepest = std::max(deepest, pinched[id].point.z - rest[id].point.z);
        const cv::Point2d below(w.points[id].x,
                                w.points[id].y + w.points[id + 1].x - w.points[id].x);
        for (std::size_t other = id + 2; other < w.points.size(); ++other) {
            if (w.points[id + 1].y == w.points[id].y && cv::norm(w.points[other] - below) < 4) {
                smallest = std::min(
                    smallest, area(pinched, id, id + 1, other) / area(rest, id, id + 1, other));
            }
        }
    }
    CHECK(smallest < 0.5);
    CHECK(smallest > 0.3);
    CHECK(deepest > 8);
    CHECK(deepest < 14);
}

TEST_CASE("lobes slide on each other by 5 mm, a step of 8 mm apart, each as one") {
    const Written& w = lobes();
    const auto &first = w.truth[0], &last = w.truth[9];
    int neighbours = 0, parted = 0;
    double highest = 0;
    for (std::size_t a = 0; a < w.points.size(); ++a) {
        for (std::size_t b = a + 1; b < w.points.size(); ++b) {
            const cv::Point3d before = first[b].point - first[a].point,
                              after = last[b].point - last[a].point;
            if (cv::norm(w.points[b] - w.points[a]) > 25) {
                continue;
            }
            ++neighbours;
            const double slid = cv::norm(after - before);
            CHECK((slid < 1.5 || slid > 4));
            CHECK(slid < 7);
            if (slid > 4) {
                ++parted;
                highest = std::max(highest, std::abs(before.z));
            }
        }
    }
    CHECK(parted > 6);
    CHECK(parted < neighbours / 4);
    CHECK(highest > 7);
    CHECK(highest < 12);
}

TEST_CASE("a cut opens by 9 mm, its sides move apart and a dark floor lies below") {
    const Written& w = shared("cut", true);
    const auto& closed = w.truth[0];
    const auto& open = w.truth[kSharedFrames - 1];
    // The pair of neighbours that the cut parts most.
    std::size_t one = 0, other = 0;
    double widest = 0;
    for (std::size_t a = 0; a < w.points.size(); ++a) {
        for (std::size_t b = a + 1; b < w.points.size(); ++b) {
            const double before = cv::norm(closed[b].point - closed[a].point);
            const double wider = cv::norm(open[b].point - open[a].point) - before;
            if (before < 6 && wider > widest) {
                widest = wider;
                one = a;
                other = b;
            }
        }
    }
    CHECK(widest > 6.5);
    CHECK(widest < 9.5);
    CHECK(open[one].visible);
    CHECK(open[other].visible);
    const cv::Point3d middle = w.in_rectified(0.5 * (open[one].point + open[other].point));
    const cv::Point pixel(static_cast<int>(std::lround(middle.x)),
                          static_cast<int>(std::lround(middle.y)));
    const cv::Mat disparity = cv::imread(
        (w.folder.path / "disparity" / numbered(kSharedFrames - 1)).string(), cv::IMREAD_UNCHANGED);
    REQUIRE(disparity.at<std::uint16_t>(pixel) > 0);
    const double sides = 0.5 * (open[one].point.z + open[other].point.z);
    const double floor = sides * middle.z / (disparity.at<std::uint16_t>(pixel) / 256.0);
    CHECK(floor - sides > 4);
    CHECK(floor - sides < 8);
    cv::Mat red;
    cv::extractChannel(w.image("left", kSharedFrames - 1), red, 2);
    const cv::Point2d from = w.in_raw(open[one].point), to = w.in_raw(open[other].point);
    std::vector<double> inside, everywhere;
    for (double share = 0.3; share < 0.7; share += 0.02) {
        inside.push_back(red.at<std::uint8_t>(cv::Point(from + share * (to - from))));
    }
    everywhere.assign(red.begin<std::uint8_t>(), red.end<std::uint8_t>());
    CHECK(median(inside) < 0.88 * median(everywhere));
}

TEST_CASE("two instruments cover more than 40 % of the view together") {
    const Written& w = shared("two-instruments");
    const auto covered = [&](int frame) {
        cv::Mat channels[3], red, bright;
        cv::split(w.image("left", frame), channels);
        cv::compare(channels[2], channels[1] + 22, red, cv::CMP_GT);
        cv::compare(channels[1], 150, bright, cv::CMP_GT);
        return 1 - cv::countNonZero(red | bright) / static_cast<double>(w.size.area());
    };
    CHECK(covered(0) < 0.03);
    CHECK(covered(kSharedFrames - 1) > 0.40);
    CHECK(covered(kSharedFrames - 1) < 0.65);
}

/// Scale against the first frame: the median over neighbours that the image still shows.
double scale(const Written& w, std::size_t frame) {
    std::vector<double> ratios;
    for (std::size_t id = 1; id < w.points.size(); ++id) {
        const TruthRow &a = w.truth[frame][id - 1], &b = w.truth[frame][id];
        if (w.points[id].y == w.points[id - 1].y && a.visible && b.visible) {
            ratios.push_back(cv::norm(w.in_raw(b.point) - w.in_raw(a.point)) /
                             cv::norm(w.points[id] - w.points[id - 1]));
        }
    }
    return median(ratios);
}

TEST_CASE(
    "approach comes to 0.6 of the distance, roll turns by 75 degrees, slide leaves the view") {
    SUBCASE("approach") {
        const Written w({.scene = "approach", .width = 160, .height = 120, .frames = 45});
        CHECK(scale(w, 44) > 1.5);
        CHECK(scale(w, 44) < 1.8);
        // The camera moves to the right as well, where that is asked.
        defrec::cli::Film aside("approach", 160, 120, 45, 1, 2, {{"aside", 24}});
        for (int i = 0; i <= 44; ++i) aside.advance();
        const std::size_t middle = aside.points().size() / 2;
        CHECK(w.truth[44][middle].point.x - aside.truth(middle).position.x() ==
              doctest::Approx(24).epsilon(0.1));
    }
    SUBCASE("roll") {
        const Written w({.scene = "roll", .width = 160, .height = 120, .frames = 59});
        const auto direction = [&](std::size_t frame) {
            const cv::Point3d along = w.truth[frame][1].point - w.truth[frame][0].point;
            return std::atan2(along.y, along.x) * 180 / CV_PI;
        };
        CHECK(std::abs(direction(31) - direction(0)) == doctest::Approx(75).epsilon(0.05));
        CHECK(std::abs(direction(58) - direction(0)) < 5);
    }
    SUBCASE("slide") {
        const Written w({.scene = "slide", .width = 160, .height = 120, .frames = 51});
        const auto visible = [&](std::size_t frame) {
            return std::count_if(w.truth[frame].begin(), w.truth[frame].end(),
                                 [](const TruthRow& r) { return r.visible; });
        };
        CHECK(visible(50) < 0.6 * visible(0));
        CHECK(visible(50) > 0.2 * visible(0));
        // Tissue fills the view to the end.
        CHECK(cv::countNonZero(w.rectified("left", 50) > 20) > 0.99 * w.size.area());
        // With a period it comes back, but for the beat and the hand's tremor.
        defrec::cli::Film film("slide", 160, 120, 48, 1, 2, {{"period", 40}});
        film.advance();
        const auto truths = [&] {
            std::vector<defrec::cli::Film::Truth> all;
            for (std::size_t i = 0; i < film.points().size(); ++i) all.push_back(film.truth(i));
            return all;
        };
        const auto first = truths();
        const auto farthest = [&] {
            double distance = 0;
            const auto now = truths();
            for (std::size_t i = 0; i < now.size(); ++i)
                distance = std::max(distance, (now[i].position - first[i].position).norm());
            return distance;
        };
        for (int i = 1; i <= 24; ++i) film.advance();
        CHECK(farthest() > 40);
        for (int i = 25; i <= 44; ++i) film.advance();
        CHECK(farthest() < 8);
    }
}

TEST_CASE("out of the body nothing is visible, before and after most is") {
    const Written w({.scene = "out-of-body", .width = 160, .height = 120, .frames = 12});
    int blank = 0;
    for (int frame = 0; frame < 12; ++frame) {
        const auto& rows = w.truth[static_cast<std::size_t>(frame)];
        const auto visible =
            std::count_if(rows.begin(), rows.end(), [](const TruthRow& r) { return r.visible; });
        const cv::Scalar mean = cv::mean(w.image("left", frame));
        CAPTURE(frame);
        if (mean[2] < mean[0] + 20) {  // not red
            CHECK(visible == 0);
            ++blank;
        } else {
            CHECK(static_cast<double>(visible) > 0.6 * static_cast<double>(rows.size()));
        }
    }
    CHECK(blank >= 3);
    CHECK(blank <= 5);
}

/// Points that the truth calls hidden lie on steel, visible ones on tissue, in frames first and
/// later.
void check_hidden(const Written& w, std::size_t first, int hidden) {
    int steel = 0, tissue = 0, wrong = 0;
    for (std::size_t frame = first; frame < w.truth.size(); ++frame) {
        const cv::Mat image = w.image("left", static_cast<int>(frame));
        for (const TruthRow& row : w.truth[frame]) {
            const cv::Point2d pixel = w.in_raw(row.point);
            const cv::Rect inner(1, 1, image.cols - 2, image.rows - 2);
            if (!inner.contains(cv::Point(pixel))) {
                continue;
            }
            cv::Mat patch;
            cv::getRectSubPix(image, {3, 3}, cv::Point2f(pixel), patch);
            const cv::Scalar colour = cv::mean(patch);
            const bool red = colour[2] > colour[1] + 22;
            const bool white = colour[1] > 150;
            ++(row.visible ? tissue : steel);
            wrong += row.visible != red && !white ? 1 : 0;
        }
    }
    CHECK(steel >= hidden);
    CHECK(tissue > 40 * static_cast<int>(w.truth.size() - first));
    CHECK(wrong < (steel + tissue) / 100);
}

TEST_CASE("points behind the instrument are hidden, and only those") {
    SUBCASE("indentation") {
        check_hidden(Written({.scene = "indentation", .width = 320, .height = 180, .frames = 5}), 0,
                     10);
    }
    SUBCASE("pinch") { check_hidden(shared("pinch"), 15, 20); }
    SUBCASE("grasp") { check_hidden(shared("grasp"), 18, 20); }
    SUBCASE("two instruments") { check_hidden(shared("two-instruments"), 18, 300); }
}

TEST_CASE("row 51: a dropped frame repeats picture and truth of the one before") {
    const Written w({.scene = "heartbeat", .width = 160, .height = 120, .frames = 6});
    int repeated = 0;
    for (int frame = 1; frame < 6; ++frame) {
        const bool same = slurp(w.folder.path / "left" / numbered(frame)) ==
                          slurp(w.folder.path / "left" / numbered(frame - 1));
        if (same) {
            ++repeated;
            for (std::size_t id = 0; id < w.points.size(); ++id) {
                CHECK(w.truth[static_cast<std::size_t>(frame)][id].point ==
                      w.truth[static_cast<std::size_t>(frame) - 1][id].point);
            }
        }
    }
    CHECK(repeated == 1);
}

TEST_CASE("an interlaced image has the rows of two times, and the truth has both") {
    const auto render = [](const TemporaryFolder& folder, FieldOrder fields) {
        defrec::cli::render_sequence({.scene = "slide",
                                      .out_dir = folder.path.string(),
                                      .width = 160,
                                      .height = 121,
                                      .frames = 3,
                                      .fields = fields},
                                     {});
    };
    // "id,x,y,z,visible" of each row of a frame
    const auto truth_of = [](const TemporaryFolder& folder, int frame) {
        std::istringstream file(slurp(folder.path / "truth.csv"));
        const std::string begin = std::to_string(frame) + ",";
        std::string line, rows;
        while (std::getline(file, line))
            if (line.rfind(begin, 0) == 0) rows += line.substr(begin.size()) + "\n";
        return rows;
    };
    const TemporaryFolder whole;
    render(whole, FieldOrder::kProgressive);
    for (const FieldOrder order : {FieldOrder::kTopFirst, FieldOrder::kBottomFirst}) {
        const TemporaryFolder folder;
        render(folder, order);
        for (int i = 0; i < 3; ++i) {
            CHECK(truth_of(folder, 2 * i) == truth_of(whole, i));
            CHECK_FALSE(truth_of(folder, 2 * i + 1).empty());
            CHECK(truth_of(folder, 2 * i + 1) != truth_of(whole, i));
        }
        CHECK(truth_of(folder, 6).empty());
        for (const char* view : {"left", "right"}) {
            const auto image_in = [&](const TemporaryFolder& of) {
                return cv::imread((of.path / view / numbered(0)).string());
            };
            const cv::Mat image = image_in(folder), progressive = image_in(whole);
            const int first = order == FieldOrder::kTopFirst ? 0 : 1;
            for (int y = 0; y < image.rows; ++y)
                CHECK((cv::norm(image.row(y), progressive.row(y), cv::NORM_INF) == 0) ==
                      (y % 2 == first));
        }
        CHECK_FALSE(fs::exists(folder.path / "left" / numbered(3)));
    }
}

TEST_CASE("what cannot be rendered is refused before anything is written") {
    const TemporaryFolder folder;
    RenderOptions good;
    good.scene = "heartbeat";
    good.out_dir = (folder.path / "out").string();
    good.width = 160;
    good.height = 120;
    good.frames = 1;
    const auto refused = [&](auto change) {
        RenderOptions options = good;
        change(options);
        CHECK_THROWS_AS(defrec::cli::render_sequence(options, {}), RenderUsageError);
        CHECK_FALSE(fs::exists(folder.path / "out"));
    };
    refused([](RenderOptions& o) { o.scene = "hartbeat"; });
    refused([](RenderOptions& o) { o.scene = ""; });
    refused([](RenderOptions& o) { o.width = 159; });
    refused([](RenderOptions& o) { o.height = 100000; });
    refused([](RenderOptions& o) { o.frames = -1; });
    refused([](RenderOptions& o) { o.out_dir = ""; });
    refused([](RenderOptions& o) {
        o.scene = "respiration";
        o.depth = true;
    });
    refused([](RenderOptions& o) { o.settings = {{"depth", 1}}; });
    const auto refused_for_indentation = [&](const std::string& parameter, double value) {
        refused([&](RenderOptions& o) {
            o.scene = "indentation";
            o.settings = {{parameter, value}};
        });
    };
    refused_for_indentation("dept", 1);
    refused_for_indentation("depth", -0.001);
    refused_for_indentation("depth", 12.001);
    refused_for_indentation("depth", std::nan(""));
    std::ofstream(folder.path / "file") << "in the way";
    good.out_dir = (folder.path / "file" / "out").string();
    CHECK_THROWS_AS(defrec::cli::render_sequence(good, {}), RenderOutputError);
}

TEST_CASE("a misspelt scene is answered with the nearest") {
    const auto said = [](const std::string& scene) -> std::string {
        RenderOptions options;
        options.scene = scene;
        options.out_dir = "absent";
        try {
            defrec::cli::render_sequence(options, {});
        } catch (const RenderUsageError& error) {
            return error.what();
        }
        return "rendered";
    };
    CHECK(
        said("hartbeat") ==
        "there is no scene named 'hartbeat'; did you mean heartbeat? 'defrec render --list' names "
        "all");
    CHECK(said("qwertz") == "there is no scene named 'qwertz'; 'defrec render --list' names all");
}

TEST_CASE("row 115: images of others are neither overwritten nor mixed with those rendered") {
    const TemporaryFolder folder;
    RenderOptions options;
    options.scene = "heartbeat";
    options.out_dir = folder.path.string();
    options.width = 160;
    options.height = 120;
    options.frames = 1;
    const auto refused_for = [&](const fs::path& file) {
        fs::create_directories(file.parent_path());
        std::ofstream(file) << "somebody's";
        CHECK_THROWS_AS(defrec::cli::render_sequence(options, {}), RenderUsageError);
        CHECK(slurp(file) == "somebody's");
        fs::remove(file);
    };
    // A recording that has the same names, and no truth.
    refused_for(folder.path / "left/000000.png");
    refused_for(folder.path / "right/frame_1.jpg");
    CHECK_FALSE(fs::exists(folder.path / "truth.csv"));
    CHECK(defrec::cli::render_sequence(options, {}) == 1);
    CHECK(defrec::cli::render_sequence(options, {}) == 1);
    // Images of another kind in a rendered sequence would be read with its own.
    refused_for(folder.path / "left/frame_1.jpg");
    refused_for(folder.path / "disparity/000000.pfm");
    CHECK(defrec::cli::render_sequence(options, {}) == 1);
    // A data set's folder is not emptied.
    options.layout = "hamlyn";
    options.out_dir = (folder.path / "set").string();
    CHECK(defrec::cli::render_sequence(options, {}) == 1);
    const std::size_t files = static_cast<std::size_t>(
        std::distance(fs::recursive_directory_iterator(folder.path / "set"), {}));
    CHECK_THROWS_AS(defrec::cli::render_sequence(options, {}), RenderUsageError);
    CHECK(files == static_cast<std::size_t>(
                       std::distance(fs::recursive_directory_iterator(folder.path / "set"), {})));
}

TEST_CASE("the command answers with exit codes") {
    const TemporaryFolder folder;
    const std::string out = (folder.path / "out").string();
    CHECK(run_command({"render", "--list"}) == 0);
    CHECK(run_command({"render"}) == 2);
    CHECK(run_command({"render", "nowhere", "--out", out}) == 2);
    CHECK(run_command({"render", "smoke", "--out", out, "--size", "160"}) == 2);
    CHECK(run_command({"render", "smoke", "--out", out, "--size", "160x120x3"}) == 2);
    for (const char* setting : {"depth", "depth=", "=3", "depth=3mm", "depth=13", "width=3"}) {
        CAPTURE(setting);
        CHECK(run_command({"render", "indentation", "--out", out, "--set", setting}) == 2);
    }
    CHECK(run_command({"render", "smoke", "--out", "/dev/null/out", "--size", "160x120"}) == 7);
    CHECK(run_command({"render", "smoke", "--out", out, "--size", "160x120", "--frames", "2",
                       "--quiet"}) == 0);
    CHECK(fs::exists(folder.path / "out/right/000001.png"));
    CHECK_FALSE(fs::exists(folder.path / "out/right/000002.png"));
    CHECK(run_command({"render", "smoke", "--out", out, "--size", "160x120", "--frames", "1",
                       "--quiet"}) == 0);
    CHECK(fs::exists(folder.path / "out/right/000000.png"));
    CHECK_FALSE(fs::exists(folder.path / "out/right/000001.png"));
    CHECK_FALSE(fs::exists(folder.path / "out/truth.defrec-0.partial.csv"));
}

TEST_CASE("a parameter's own value changes nothing, another value changes the scene") {
    const TemporaryFolder folder;
    const auto truth = [&](const std::vector<std::string>& settings) {
        const std::string out = (folder.path / "out").string();
        std::vector<std::string> arguments = {"render",  "indentation", "--out", out,      "--size",
                                              "160x120", "--frames",    "6",     "--quiet"};
        for (const std::string& setting : settings) {
            arguments.insert(arguments.end(), {"--set", setting});
        }
        CHECK(run_command(arguments) == 0);
        return slurp(folder.path / "out/truth.csv");
    };
    const std::string plain = truth({});
    CHECK(truth({"depth=7"}) == plain);
    CHECK(truth({"depth=3", "depth=7.0"}) == plain);
    CHECK(truth({"depth=3"}) != plain);
}

TEST_CASE("row 73: a stopped rendering leaves whole frames and their truth, and says so") {
    const TemporaryFolder folder;
    const std::string out = (folder.path / "out").string();
    int asked = 0;
    const auto stop = [&] { return ++asked == 2; };
    CHECK(run_command({"render", "stretch", "--out", out, "--size", "160x120", "--frames", "9"},
                      stop) == 130);
    CHECK(fs::exists(folder.path / "out/left/000001.png"));
    CHECK_FALSE(fs::exists(folder.path / "out/left/000002.png"));
    const std::string truth = slurp(folder.path / "out/truth.csv");
    CHECK(truth.find("\n1,0,") != std::string::npos);
    CHECK(truth.find("\n2,0,") == std::string::npos);
}

TEST_CASE(
    "points of a later image lie on tissue that is new there, with truth from that frame on") {
    constexpr int kGiven = 24, kCount = 26;
    TemporaryFolder folder;
    RenderOptions options;
    options.scene = "slide";
    options.out_dir = folder.path.string();
    options.width = 320;
    options.height = 180;
    options.frames = kCount;
    options.points_at = {kGiven};
    render_sequence(options, {});
    std::istringstream points(slurp(folder.path / "points.csv")),
        truth(slurp(folder.path / "truth.csv"));
    std::string line;
    REQUIRE(std::getline(points, line));
    CHECK(line == "id,u,v,frame");
    std::size_t first = 0, count = 0;
    for (; std::getline(points, line); ++count) {
        std::size_t id = 0;
        int frame = 0;
        REQUIRE(std::sscanf(line.c_str(), "%zu,%*f,%*f,%d", &id, &frame) == 2);
        CHECK(id == count);
        first += frame == 0;
        CHECK(frame == (id < first ? 0 : kGiven));
    }
    REQUIRE(first > 0);
    REQUIRE(count > first);
    REQUIRE(std::getline(truth, line));
    std::size_t early = 0, late = 0;
    while (std::getline(truth, line)) {
        int frame = 0;
        std::size_t id = 0;
        REQUIRE(std::sscanf(line.c_str(), "%d,%zu", &frame, &id) == 2);
        (id < first ? early : late) += 1;
        if (id >= first) {
            CHECK(frame >= kGiven);
        }
    }
    CHECK(early == first * kCount);
    CHECK(late == (count - first) * (kCount - kGiven));
}
