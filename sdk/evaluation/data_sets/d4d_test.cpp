// D4D: nearest points by hand, rendered scenes in a miniature of the layout, malformed copies.
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "sdk/evaluation/data_sets/point_cloud.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 6, kWidth = 320, kHeight = 240;
const char* const kSession = "specimen_1/2025_03_06-16_49_40";
const char* const kClip = "specimen_1/2025_03_06-16_49_40/clips/Clip_1";

struct Camera {
    double f = 0, cx = 0, cy = 0, baseline = 0;
};

// As the structured-light camera has it: turned about y and away from the endoscope, in `unit` mm.
cv::Point3d to_cloud(const cv::Point3d& p, double unit) {
    const double c = std::cos(0.3), s = std::sin(0.3);
    return cv::Point3d(c * p.x + s * p.z + 150, p.y - 40, -s * p.x + c * p.z + 600) / unit;
}

void write_pose(const fs::path& to, double unit, bool is_inverse) {
    const double c = std::cos(0.3), s = std::sin(0.3);
    cv::Matx33d r(c, 0, s, 0, 1, 0, -s, 0, c);
    cv::Vec3d t = cv::Vec3d(150, -40, 600) * (1 / unit);
    if (is_inverse) {
        r = r.t();
        t = -(r * t);
    }
    std::ofstream file(to);
    file.precision(12);
    for (int i = 0; i < 3; ++i)
        file << r(i, 0) << " " << r(i, 1) << " " << r(i, 2) << " " << t[i] << "\n";
    file << "0 0 0 1\n";
}

// lift: mm by which the cloud lies nearer to the endoscope.
void write_cloud(const cv::Mat& disparity, const Camera& camera, const fs::path& to, double unit,
                 double lift) {
    std::ofstream file(to);
    file.precision(9);
    std::string body;
    int count = 0;
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            const double d = disparity.at<std::uint16_t>(v, u) / 256.0;
            if (d == 0) continue;
            const double z = camera.f * camera.baseline / d - lift;
            const cv::Point3d p =
                to_cloud({(u - camera.cx) / camera.f * z, (v - camera.cy) / camera.f * z, z}, unit);
            body += exact(p.x) + " " + exact(p.y) + " " + exact(p.z) + "\n";
            ++count;
        }
    }
    file << "ply\nformat ascii 1.0\nelement vertex " << count + 1
         << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
         << body << "nan nan nan\n";
}

struct Variant {
    double unit = 1;  // mm
    bool is_inverse = false;
    double lift = 0;  // of the cloud at the end, mm
};

const TestFolder& rendered() {
    static const TestFolder folder;
    static const bool is_made = [] {
        RenderOptions options;
        options.scene = "heartbeat";
        options.out_dir = folder.path().string();
        options.width = kWidth;
        options.height = kHeight;
        options.frames = kFrames;
        options.depth = true;
        render_sequence(options, {});
        return true;
    }();
    static_cast<void>(is_made);
    return folder;
}

void write_data_set(const fs::path& root, const Variant& variant) {
    const fs::path session = root / kSession, clip = root / kClip;
    for (const char* folder : {"camera_info", "pointcloud"})
        fs::create_directories(session / folder);
    fs::create_directories(clip);
    fs::copy(rendered().path() / "left", clip / "left_images_rect");
    fs::copy(rendered().path() / "right", clip / "right_images_rect");
    cv::FileStorage calibration((rendered().path() / "calibration.yaml").string(),
                                cv::FileStorage::READ);
    cv::Mat m1, m2, t;
    calibration["M1"] >> m1;
    calibration["M2"] >> m2;
    calibration["T"] >> t;
    const Camera camera{m1.at<double>(0, 0), m1.at<double>(0, 2), m1.at<double>(1, 2),
                        -t.at<double>(0)};
    const auto info = [&](const char* name, const cv::Mat& m, double shift) {
        std::ofstream(session / "camera_info" / name)
            << "image_width: 320\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: ["
            << exact(m.at<double>(0, 0)) << ", 0, " << exact(m.at<double>(0, 2)) << ", "
            << exact(shift / 1000) << ", 0, " << exact(m.at<double>(1, 1)) << ", "
            << exact(m.at<double>(1, 2)) << ", 0, 0, 0, 1, 0]\n";
    };
    info("left_rect.yaml", m1, 0);
    info("right_rect.yaml", m2, -camera.f * camera.baseline);
    const auto disparity = [&](int frame) {
        return cv::imread((rendered().path() / cv::format("disparity/%06d.png", frame)).string(),
                          cv::IMREAD_UNCHANGED);
    };
    write_cloud(disparity(0), camera, session / "pointcloud/a.ply", variant.unit, 0);
    write_cloud(disparity(kFrames - 1), camera, session / "pointcloud/b.ply", variant.unit,
                variant.lift);
    std::ofstream(session / "clips.json")
        << R"([{"name": "Clip_2"}, {"name": "Clip_1", "start": {"timestamp": 1.5},)"
        << R"( "end": {"timestamp": 2.5}, "start_geometry": "a.ply", "end_geometry": "b.ply"}])";
    for (const char* end : {"start", "end"})
        write_pose(clip / (std::string("curated_camera_pose_") + end + ".txt"), variant.unit,
                   variant.is_inverse);
}

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = (write_data_set(folder.path(), {}), true);
    static_cast<void>(is_made);
    return folder;
}

// Results of the only clip, by the first method.
struct Result {
    double visible, occluded, lost, start;
};
Result evaluate(const fs::path& root) {
    const TestFolder out;
    REQUIRE(evaluate_set("d4d", root, out.path()) == 0);
    return {result_of(out.path(), kClip, "visible_mean_mm"),
            result_of(out.path(), kClip, "occluded_mean_mm"),
            result_of(out.path(), kClip, "lost_share"),
            result_of(out.path(), kClip, "start_median_mm")};
}

}  // namespace

TEST_CASE("the tree finds the nearest of all points") {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> side(-10, 10);
    std::vector<cv::Point3f> points;
    for (int i = 0; i < 500; ++i) points.emplace_back(side(random), side(random), side(random) / 5);
    points.insert(points.end(), 40, points.front());  // equal ones
    const PointCloud cloud(points);
    for (int i = 0; i < 300; ++i) {
        const cv::Point3d place(1.5 * side(random), side(random), side(random));
        double nearest = 1e9;
        for (const cv::Point3f& point : points)
            nearest = std::min(nearest, cv::norm(place - cv::Point3d(point)));
        CHECK(cloud.distance(place) == doctest::Approx(nearest));
    }
    CHECK(PointCloud({{1, 2, 3}}).distance({1, 2, 5}) == 2);
}

TEST_CASE("metrics of D4D by hand: lost points are in none but their share") {
    const DataSet& d4d = data_set_of("d4d");
    Samples samples(d4d.sample_columns());
    samples.add({0, 1, 0.5, 1});
    samples.add({1, 1, 1.5, 2});
    samples.add({2, 0, NAN, 8});
    samples.add({3, 0, 1.0, NAN});
    const std::vector<double> metrics = d4d.summarise(samples);
    REQUIRE(metrics.size() == d4d.metrics().size());
    CHECK(metrics[0] == 1.5);
    CHECK(metrics[1] == 1.5);
    CHECK(metrics[2] == doctest::Approx(1.95));
    CHECK(metrics[3] == 8);
    CHECK(metrics[6] == 0.25);
    CHECK(metrics[7] == 1);
    CHECK(std::isnan(d4d.summarise(Samples(d4d.sample_columns()))[0]));
}

TEST_CASE(
    "a surface that is followed lies in the cloud at the end, one that never moves does not") {
    const TestFolder out;
    REQUIRE(evaluate_set("d4d", data_set().path(), out.path(),
                         {"--method", "defrec", "--method", "still"}) == 0);
    CsvReader results(out.path() / "results.csv",
                      {"variant", "visible_mean_mm", "start_median_mm"});
    double followed = NAN, still = NAN;
    while (results.next()) {
        (results.field(0) == "defrec" ? followed : still) = results.number(1);
        CHECK(results.number(2) < 1);  // the control has OpenCV's depth
    }
    CHECK(followed < 0.5);
    CHECK(still > 2 * followed);
    CsvReader effects(out.path() / "effects.csv", {"metric", "clips", "low", "high"});
    REQUIRE(effects.next());
    CHECK(effects.field(0) == "visible_mean_mm");
    CHECK(effects.integer(1) == 1);
}

TEST_CASE("metres, and poses that lead the other way, give the same") {
    const Result usual = evaluate(data_set().path());
    for (const Variant& variant : {Variant{1000, false, 0}, Variant{1, true, 0}}) {
        const TestFolder root;
        write_data_set(root.path(), variant);
        const Result result = evaluate(root.path());
        CHECK(result.visible == doctest::Approx(usual.visible).epsilon(0.01));
        CHECK(result.start == doctest::Approx(usual.start).epsilon(0.01));
    }
}

TEST_CASE("a cloud that is elsewhere at the end changes the error by as much") {
    const TestFolder root;
    constexpr double kLift = 5;
    write_data_set(root.path(), {1, false, kLift});
    const Result result = evaluate(root.path());
    CHECK(result.visible > 0.7 * kLift);  // the surface is inclined
    CHECK(result.visible < 1.2 * kLift);
    CHECK(result.start < 0.5);
}

TEST_CASE("points under an instrument at the end are occluded, whichever of both is marked") {
    for (const int mark : {255, 0}) {
        const TestFolder root, out;
        fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
        const fs::path masks = root.path() / kClip / "left_images_rect_masks";
        fs::create_directories(masks);
        for (int frame = 0; frame < kFrames; ++frame) {
            cv::Mat mask(kHeight, kWidth, CV_8U, cv::Scalar(255 - mark));
            if (frame == kFrames - 1) mask.colRange(0, kWidth / 3).setTo(mark);
            cv::imwrite((masks / cv::format("%06d.png", frame)).string(), mask);
        }
        REQUIRE(evaluate_set("d4d", root.path(), out.path()) == 0);
        const fs::path folder = ClipStore(out.path()).folder({"defrec", kClip});
        CsvReader samples(folder / "samples.csv", {"point", "visible", "end_mm"});
        int visible = 0, occluded = 0;
        while (samples.next()) {
            if (samples.is_empty(2)) continue;
            (samples.integer(1) != 0 ? visible : occluded) += 1;
        }
        CHECK(occluded > 0.2 * (visible + occluded));
        CHECK(occluded < 0.45 * (visible + occluded));
        CHECK(result_of(out.path(), kClip, "occluded_mean_mm") < 1);
    }
}

TEST_CASE("a D4D clip that is not as expected says what was") {
    // Copies are sessions: the clip lies in clips/Clip_1.
    BrokenCopies copies(data_set().path() / kSession);
    const auto clip = [&](const char* name) { return copies.copy(name) / "clips/Clip_1"; };
    fs::remove(clip("no_pose") / "curated_camera_pose_end.txt");
    std::ofstream(clip("no_rotation") / "curated_camera_pose_start.txt")
        << "2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    std::ofstream(clip("elsewhere") / "curated_camera_pose_start.txt")
        << "1 0 0 0 0 -1 0 9000 0 0 -1 -90000 0 0 0 1";
    fs::remove(copies.copy("no_cloud") / "pointcloud/b.ply");
    std::ofstream(copies.copy("not_a_cloud") / "pointcloud/b.ply") << "solid\n";
    std::ofstream(copies.copy("empty_cloud") / "pointcloud/b.ply")
        << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
           "property float z\nend_header\nnan 0 0\n";
    std::ofstream(copies.copy("unknown") / "clips.json") << R"([{"name": "Clip_7"}])";
    std::ofstream(copies.copy("no_json") / "clips.json") << "Clip_1";
    fs::remove(copies.copy("one_camera") / "camera_info/right_rect.yaml");
    std::ofstream(copies.copy("no_p") / "camera_info/right_rect.yaml") << "K: [1, 0]\n";
    fs::create_directories(clip("no_masks") / "left_images_rect_masks");
    copies.evaluate("d4d");
    const auto says = [&](const char* name, const char* text) {
        copies.says(std::string(name) + "/clips/Clip_1", text);
    };
    says("no_pose", "curated_camera_pose_end.txt: this file was expected");
    says("no_rotation",
         "curated_camera_pose_start.txt: a camera's pose; 4x4 numbers; was expected");
    says("elsewhere", "the left camera sees none of these points");
    says("no_cloud", "pointcloud/b.ply: this file was expected: end_geometry");
    says("not_a_cloud", "b.ply:1: a PLY file was expected");
    says("empty_cloud", "points with finite x; y and z were expected");
    says("unknown", "clips.json: an entry with \"name\": \"Clip_1\"");
    says("no_json", "clips.json: an entry with");
    says("one_camera", "one YAML file with left in its name and one with right were expected");
    says("no_p", "projection_matrix: this key; or P; is missing");
    says("no_masks", "a mask for each of 6 left images was expected; there are 0");
}
