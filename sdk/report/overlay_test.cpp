// overlay.mp4: frames, size and picture after reading it back; failures.
#include "sdk/report/overlay.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

#include "sdk/report/synthetic_sequence.hpp"

namespace fs = std::filesystem;
using defrec::cli::OverlayDetail;
using defrec::cli::OverlayPainter;
using defrec::cli::OverlayWriter;
using defrec::cli::VertexStatus;
using defrec::cli::test::SyntheticSequence;

namespace {

struct Folder {
    fs::path path =
        fs::temp_directory_path() / fs::path("defrec-overlay-" + std::to_string(::getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
};

/// Pixels where the image is near a BGR colour.
int count_near(const cv::Mat& image, const cv::Scalar& colour, double tolerance) {
    cv::Mat mask;
    cv::inRange(image, colour - cv::Scalar::all(tolerance), colour + cv::Scalar::all(tolerance),
                mask);
    return cv::countNonZero(mask);
}

const cv::Scalar kObserved(191, 212, 45), kExtrapolated(36, 191, 251);

}  // namespace

TEST_CASE("the video reads back with every frame and the grid on it") {
    const Folder folder;
    const SyntheticSequence sequence(480, 270, 25);
    OverlayWriter overlay(folder.path / "overlay.mp4", 480, 270, 25, sequence.projector());
    overlay.set_template(sequence.reference());
    for (int i = 0; i < 25; ++i) overlay.add(sequence.image(i), sequence.record(i));
    CHECK_FALSE(fs::exists(folder.path / "overlay.mp4"));
    overlay.finish();
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);

    cv::VideoCapture video(overlay.path().string());
    REQUIRE(video.isOpened());
    int frames = 0;
    for (cv::Mat image; video.read(image); ++frames)
        CHECK(image.size() == cv::Size(480, 270 + 270 % 2));
    CHECK(frames == 25);
    CHECK(video.get(cv::CAP_PROP_FPS) == doctest::Approx(25));
}

TEST_CASE("the video says what is said in place of the state") {
    const Folder folder;
    const SyntheticSequence sequence(480, 270, 2);
    OverlayWriter overlay(folder.path / "overlay.mp4", 480, 270, 25, sequence.projector());
    defrec::cli::FrameRecord frame;
    frame.state = "degraded";
    for (const char* told : {"", "stalled"})
        overlay.add(cv::Mat(270, 480, CV_8UC3, cv::Scalar::all(90)), frame, told);
    overlay.finish();
    cv::VideoCapture video(overlay.path().string());
    cv::Mat degraded, stalled;
    REQUIRE(video.read(degraded));
    degraded = degraded.clone();
    REQUIRE(video.read(stalled));
    const cv::Scalar red(38, 38, 220);
    CHECK(count_near(degraded, red, 30) == 0);
    CHECK(count_near(stalled, red, 30) > 500);
}

TEST_CASE("odd sizes and gray images are taken") {
    const Folder folder;
    const SyntheticSequence sequence(161, 121, 3);
    OverlayWriter overlay(folder.path / "overlay.mp4", 161, 121, 29.97, sequence.projector());
    for (int i = 0; i < 3; ++i) {
        cv::Mat gray;
        cv::cvtColor(sequence.image(i), gray, cv::COLOR_BGR2GRAY);
        overlay.add(gray, sequence.record(i));
    }
    overlay.finish();
    cv::VideoCapture video(overlay.path().string());
    cv::Mat image;
    REQUIRE(video.read(image));
    CHECK(image.size() == cv::Size(162, 122));
}

TEST_CASE("the grid is drawn where the surface is, in the colour of its status") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    painter.set_template(sequence.reference());

    cv::Mat all_observed(540, 960, CV_8UC3, cv::Scalar::all(90)),
        half_hidden = all_observed.clone();
    auto frame = sequence.record(12);
    frame.matched.clear();
    frame.control_points.clear();
    frame.targets.clear();
    frame.points.clear();
    for (VertexStatus& status : frame.vertex_status) status = VertexStatus::observed;
    painter.draw(all_observed, frame);
    const cv::Mat middle = all_observed(cv::Rect(0, 80, 960, 400));
    CHECK(count_near(middle, kObserved, 40) > 5000);
    CHECK(count_near(middle, kExtrapolated, 40) == 0);

    const std::size_t count = frame.vertex_status.size();
    for (std::size_t i = count / 2; i < count; ++i)
        frame.vertex_status[i] = VertexStatus::extrapolated;
    painter.draw(half_hidden, frame);
    const cv::Mat upper = half_hidden(cv::Rect(0, 80, 960, 120)),
                  lower = half_hidden(cv::Rect(0, 350, 960, 120));
    CHECK(count_near(upper, kExtrapolated, 40) == 0);
    CHECK(count_near(lower, kObserved, 40) == 0);
    CHECK(count_near(lower, kExtrapolated, 40) > 1000);
}

TEST_CASE(
    "a target is a cross in a ring as wide as its expected error, dashed where extrapolated") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    defrec::cli::FrameRecord frame;
    frame.state = "tracking";
    frame.targets.resize(1);
    defrec::cli::TargetEstimate& target = frame.targets[0];
    target.xyz = {0, 0, 100};
    target.covariance = {1, 0, 0, 1, 0, 2};  // 2 mm, 20.16 px
    const auto drawn = [&](VertexStatus status) {
        target.status = status;
        cv::Mat image(540, 960, CV_8UC3, cv::Scalar::all(90));
        painter.draw(image, frame);
        return image(cv::Rect(440, 230, 80, 80)).clone();
    };
    const cv::Mat observed = drawn(VertexStatus::observed);
    const int ring = count_near(observed, kObserved, 60);
    CHECK(ring > 100);
    CHECK(count_near(observed(cv::Rect(20, 20, 40, 40)), kObserved, 60) < ring);
    CHECK(count_near(observed(cv::Rect(27, 27, 26, 26)), kObserved, 5) == 9);  // the cross alone
    const cv::Mat hidden = drawn(VertexStatus::extrapolated);
    CHECK(count_near(hidden, kObserved, 60) == 0);
    CHECK(count_near(hidden, kExtrapolated, 60) > ring / 4);
    CHECK(count_near(hidden, kExtrapolated, 60) < 3 * ring / 4);
    CHECK(count_near(drawn(VertexStatus::unknown), cv::Scalar::all(90), 0) == 80 * 80);
    target.covariance[0] = std::nanf("");
    drawn(VertexStatus::observed);
}

TEST_CASE(
    "chosen points are dots in a ring as wide as their expected error, those of a grid none") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    defrec::cli::FrameRecord frame;
    frame.state = "tracking";
    frame.points.reserve(200);
    frame.points.resize(1);
    defrec::cli::PointEstimate& point = frame.points[0];
    point.xyz = {0, 0, 100};
    point.covariance = {1, 0, 0, 1, 0, 2};  // 2 mm, 20.16 px
    const auto drawn = [&](VertexStatus status, bool is_chosen) {
        point.status = status;
        point.is_chosen = is_chosen;
        cv::Mat image(540, 960, CV_8UC3, cv::Scalar::all(90));
        painter.draw(image, frame);
        return image(cv::Rect(440, 230, 80, 80)).clone();
    };
    const cv::Scalar background = cv::Scalar::all(90);
    CHECK(count_near(drawn(VertexStatus::observed, false), background, 0) == 80 * 80);
    CHECK(count_near(drawn(VertexStatus::unknown, true), background, 0) == 80 * 80);
    const cv::Mat observed = drawn(VertexStatus::observed, true);
    CHECK(count_near(observed(cv::Rect(36, 36, 8, 8)), kObserved, 40) > 9);
    CHECK(count_near(observed, kObserved, 60) > 110);
    const cv::Mat hidden = drawn(VertexStatus::extrapolated, true);
    CHECK(count_near(hidden, kObserved, 60) == 0);
    CHECK(count_near(hidden, kExtrapolated, 60) > 30);
    // The label stands to the upper right.
    const cv::Rect beside(48, 24, 32, 12);
    const auto is_labelled = [&] {
        return count_near(drawn(VertexStatus::observed, true)(beside), cv::Scalar::all(245), 20) >
               0;
    };
    CHECK(is_labelled());
    // The first of many points, the others elsewhere, has one by its turn, but not where points
    // with a name leave no room for it; with a name it has one again.
    defrec::cli::PointEstimate elsewhere;
    elsewhere.xyz = {-30, 0, 100};
    elsewhere.is_chosen = true;
    frame.points.resize(200, elsewhere);
    CHECK(is_labelled());
    for (std::size_t i = 1; i <= 40; ++i) frame.points[i].name = "vessel";
    CHECK_FALSE(is_labelled());
    point.name = "tumour";
    CHECK(is_labelled());
}

TEST_CASE("control points and refused matches are drawn where asked for") {
    const SyntheticSequence sequence(960, 540, 40);
    defrec::cli::FrameRecord frame;
    frame.state = "tracking";
    frame.control_points = {0, 0, 80};
    frame.matched.push_back({400, 270, 440, 200, 0, false});
    const auto differs = [&](OverlayDetail detail) {
        OverlayPainter painter(sequence.projector(), detail);
        cv::Mat image(540, 960, CV_8UC3, cv::Scalar::all(90));
        painter.draw(image, frame);
        const cv::Rect middle(380, 150, 200, 200);
        return middle.area() - count_near(image(middle), cv::Scalar::all(90), 0);
    };
    CHECK(differs(OverlayDetail::usual) == 0);
    CHECK(differs(OverlayDetail::all) > 50);
}

TEST_CASE("text covers little of the picture, more where details or reasons are asked for") {
    const SyntheticSequence sequence(640, 360, 40);
    defrec::cli::FrameRecord frame;
    frame.state = "tracking";
    const auto darkened_rows = [&](OverlayDetail detail) {
        OverlayPainter painter(sequence.projector(), detail);
        cv::Mat image(360, 640, CV_8UC3, cv::Scalar::all(90));
        painter.draw(image, frame);
        int rows = 0;
        for (int y = 0; y < image.rows; ++y)
            rows += count_near(image.row(y), cv::Scalar::all(90), 0) < image.cols;
        return rows;
    };
    const int usual = darkened_rows(OverlayDetail::usual);
    CHECK(usual > 0);
    CHECK(usual < 0.1 * 360);
    CHECK(darkened_rows(OverlayDetail::all) > usual);
    frame.reasons = "occluded";
    CHECK(darkened_rows(OverlayDetail::usual) > usual);
    CHECK(darkened_rows(OverlayDetail::usual) < 0.15 * 360);
}

TEST_CASE("a page that has state and legend beside the picture gets it without text") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    defrec::cli::FrameRecord frame;
    const cv::Mat bare(540, 960, CV_8UC3, cv::Scalar::all(90));
    cv::Mat image = bare.clone();
    for (const char* state : {"tracking", "lost"}) {
        frame.state = state;
        painter.draw_without_text(image, frame);
        CHECK(count_near(image, cv::Scalar::all(90), 0) == image.size().area());
    }
    painter.draw(image, frame);
    CHECK(count_near(image, cv::Scalar::all(90), 0) < image.size().area());
}

TEST_CASE("a lost frame carries no grid") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    painter.set_template(sequence.reference());
    cv::Mat image(540, 960, CV_8UC3, cv::Scalar::all(90));
    const auto frame = sequence.record(26);
    REQUIRE(frame.state == "lost");
    painter.draw(image, frame);
    CHECK(count_near(image(cv::Rect(0, 80, 960, 400)), kObserved, 60) == 0);
}

TEST_CASE("what is said in place of the state stands above the picture, in its colour") {
    const SyntheticSequence sequence(960, 540, 40);
    OverlayPainter painter(sequence.projector());
    defrec::cli::FrameRecord frame;
    frame.state = "degraded";
    const cv::Mat bare(540, 960, CV_8UC3, cv::Scalar::all(90));
    cv::Mat degraded = bare.clone(), stalled = bare.clone();
    painter.draw(degraded, frame);
    painter.draw(stalled, frame, "stalled");
    const cv::Scalar red(38, 38, 220);
    CHECK(count_near(degraded, red, 10) == 0);
    CHECK(count_near(stalled, red, 10) > 2 * (960 + 540));  // with a frame round it
}

TEST_CASE("geometry of another template, and points that cannot be projected, are left out") {
    const SyntheticSequence sequence(320, 240, 4);
    OverlayPainter painter(sequence.projector());
    painter.set_template(sequence.reference());
    cv::Mat image(240, 320, CV_8UC3, cv::Scalar::all(90));
    auto frame = sequence.record(1);
    frame.targets.resize(1);
    frame.targets[0].status = VertexStatus::observed;
    frame.targets[0].xyz = {0, 0, -5};
    frame.points = {{VertexStatus::observed, {0, 0, -5}, {}, 1, {}, true}};
    frame.control_points = {0, 0, -5, 1e9f, 1e9f, 1, std::nanf(""), 0, 80};
    for (std::size_t i = 2; i < frame.vertices.size(); i += 3)
        frame.vertices[i] = i % 2 ? -1.0f : std::nanf("");
    frame.matched[0].live_u = std::nanf("");
    painter.draw(image, frame);
    CHECK(count_near(image(cv::Rect(0, 60, 320, 150)), kObserved, 40) == 0);
    frame.vertices.resize(3);
    painter.draw(image, frame);
}

TEST_CASE("row 72: what cannot be written is an error that names the file, and leaves nothing") {
    const Folder folder;
    const SyntheticSequence sequence(640, 360, 30);
    CHECK_THROWS_WITH_AS(
        OverlayWriter(folder.path / "none" / "overlay.mp4", 640, 360, 25, sequence.projector()),
        doctest::Contains("overlay.mp4"), std::runtime_error);
    CHECK_THROWS_AS(OverlayWriter(folder.path / "overlay.mp4", 8, 360, 25, sequence.projector()),
                    std::runtime_error);
    {
        OverlayWriter overlay(folder.path / "overlay.mp4", 640, 360, 25, sequence.projector());
        CHECK_THROWS_WITH_AS(overlay.add(cv::Mat(10, 10, CV_8UC3), sequence.record(0)),
                             doctest::Contains("10 x 10"), std::runtime_error);
    }
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("row 72: a disk that fills up while the video is written is an error") {
    const Folder folder;
    const SyntheticSequence sequence(640, 360, 30);
    // A limit on the size of files stands in for the full disk.
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit small = before;
    small.rlim_cur = 30'000;
    {
        OverlayWriter overlay(folder.path / "overlay.mp4", 640, 360, 25, sequence.projector());
        overlay.set_template(sequence.reference());
        setrlimit(RLIMIT_FSIZE, &small);
        for (int i = 0; i < 30; ++i) overlay.add(sequence.image(i), sequence.record(i));
        CHECK_THROWS_WITH_AS(overlay.finish(), doctest::Contains("disk full"), std::runtime_error);
        setrlimit(RLIMIT_FSIZE, &before);
    }
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("a writer that got no frame leaves no file") {
    const Folder folder;
    {
        OverlayWriter overlay(folder.path / "overlay.mp4", 64, 48, 0,
                              SyntheticSequence(64, 48, 2).projector());
        overlay.finish();
    }
    CHECK(fs::is_empty(folder.path));
}
