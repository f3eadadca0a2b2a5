// Scenes with an elastic body, read back from their files.
#include "sdk/scenes/body_scenes.hpp"

#include <Eigen/SVD>
#include <array>
#include <map>

#include "sdk/scenes/writing/written_sequence.hpp"

namespace fs = std::filesystem;
using defrec::cli::kBodyDepths;
using defrec::cli::RenderOptions;
using defrec::cli::RenderUsageError;
using defrec::cli::slurp;
using defrec::cli::Written;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

struct Targets {
    std::vector<double> depths;        ///< mm, by id
    std::vector<Matrix3Xd> positions;  ///< frame: one column for each id
};

Targets targets_of(const Written& w) {
    Targets targets;
    std::ifstream first(w.folder.path / "targets.csv"), rows(w.folder.path / "truth_deep.csv");
    std::string line, expected;
    REQUIRE(std::getline(first, line));
    REQUIRE(line == "id,depth,x,y,z");
    std::vector<std::string> of_first;
    while (std::getline(first, line)) of_first.push_back("0," + line);
    targets.depths.resize(of_first.size());
    REQUIRE(std::getline(rows, line));
    REQUIRE(line == "frame,id,depth,x,y,z");
    std::size_t frame = 0, id = 0;
    Vector3d p;
    double depth = 0;
    for (std::size_t row = 0; std::getline(rows, line); ++row) {
        REQUIRE(std::sscanf(line.c_str(), "%zu,%zu,%lf,%lf,%lf,%lf", &frame, &id, &depth, &p.x(),
                            &p.y(), &p.z()) == 6);
        REQUIRE(frame == row / of_first.size());
        REQUIRE(id == row % of_first.size());
        if (frame == 0) CHECK(line == of_first[id]);
        if (id == 0) targets.positions.emplace_back(3, of_first.size());
        targets.positions.back().col(static_cast<Eigen::Index>(id)) = p;
        targets.depths[id] = depth;
    }
    REQUIRE(targets.positions.size() == w.truth.size());
    REQUIRE(targets.positions.back().cols() == static_cast<Eigen::Index>(id + 1));
    return targets;
}

/// mm by which `to` is at most away from the rigid motion of `from` that fits best (Kabsch).
double not_rigid(const Matrix3Xd& from, const Matrix3Xd& to) {
    const Vector3d a = from.rowwise().mean(), b = to.rowwise().mean();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(
        (to.colwise() - b) * (from.colwise() - a).transpose(),
        Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d proper = Eigen::Matrix3d::Identity();
    proper(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Eigen::Matrix3d rotation = svd.matrixU() * proper * svd.matrixV().transpose();
    return (rotation * (from.colwise() - a) - (to.colwise() - b)).colwise().norm().maxCoeff();
}

/// Rows of held_motion.csv, by frame.
std::vector<Eigen::Matrix<double, 3, 4>> held_motion(const Written& w) {
    std::ifstream file(w.folder.path / "held_motion.csv");
    std::string line;
    REQUIRE(std::getline(file, line));
    REQUIRE(line == "frame,r11,r12,r13,tx,r21,r22,r23,ty,r31,r32,r33,tz");
    std::vector<Eigen::Matrix<double, 3, 4>> motions;
    while (std::getline(file, line)) {
        std::istringstream fields(line);
        std::string field;
        REQUIRE(std::getline(fields, field, ','));
        REQUIRE(field == std::to_string(motions.size()));
        Eigen::Matrix<double, 3, 4>& motion = motions.emplace_back();
        for (int i = 0; i < 12; ++i) {
            REQUIRE(std::getline(fields, field, ','));
            motion(i / 4, i % 4) = std::stod(field);
        }
    }
    return motions;
}

/// Targets at depth 0 in a frame are where the disparity picture shows the surface, but for those
/// that the tool hides.
void check_on_surface(const Written& w, const Targets& targets, int frame) {
    const cv::Mat disparity =
        cv::imread((w.folder.path / "disparity" / defrec::cli::numbered(frame)).string(),
                   cv::IMREAD_UNCHANGED);
    std::vector<double> errors;
    for (Eigen::Index id = 0; id < 45; ++id) {
        REQUIRE(targets.depths[static_cast<std::size_t>(id)] == 0);
        const Vector3d p = targets.positions[static_cast<std::size_t>(frame)].col(id);
        const cv::Point3d pixel = w.in_rectified({p.x(), p.y(), p.z()});
        const cv::Point at(static_cast<int>(std::lround(pixel.x)),
                           static_cast<int>(std::lround(pixel.y)));
        if (!cv::Rect(cv::Point(), w.size).contains(at)) continue;
        const double shown = disparity.at<std::uint16_t>(at) / 256.0;
        if (shown > 0) errors.push_back(std::abs(shown - pixel.z) / pixel.z * p.z());
    }
    REQUIRE(errors.size() > 25);
    // mm of depth; the picture's are of the middles of pixels, and in steps of 1/256 px.
    CHECK(defrec::cli::median(errors) < 0.15);
}

std::vector<double> depths_of(const Targets& targets) {
    std::vector<double> depths = targets.depths;
    depths.erase(std::unique(depths.begin(), depths.end()), depths.end());
    return depths;
}

}  // namespace

TEST_CASE("targets lie in the layers of their body, the first of them on the surface shown") {
    const std::vector<double> all(kBodyDepths.begin(), kBodyDepths.end());
    SUBCASE("indented") {
        const Written w(
            {.scene = "body-indent", .width = 240, .height = 135, .frames = 16, .depth = true});
        const Targets targets = targets_of(w);
        CHECK(depths_of(targets) == all);
        CHECK(targets.depths.size() == 7 * 45);
        check_on_surface(w, targets, 0);
        check_on_surface(w, targets, 15);
        CHECK(not_rigid(targets.positions[0], targets.positions[15]) > 3);
    }
    SUBCASE("a thin organ, bent") {
        const Written w(
            {.scene = "body-organ", .width = 240, .height = 135, .frames = 16, .depth = true});
        const Targets targets = targets_of(w);
        CHECK(depths_of(targets) == std::vector<double>{0, 2, 5, 10});
        check_on_surface(w, targets, 15);
        CHECK(not_rigid(targets.positions[0], targets.positions[15]) > 0.3);
    }
    SUBCASE("a layer, down to its base") {
        CHECK(depths_of(targets_of(Written({.scene = "body-layer",
                                            .settings = {{"thickness", 20}},
                                            .width = 160,
                                            .height = 120,
                                            .frames = 1}))) == std::vector<double>{0, 2, 5, 10});
    }
}

TEST_CASE("targets lie beneath the surface at rest by their depth, along the first camera's axis") {
    // Without the hand's tremor the first camera looks along z.
    const Targets targets = targets_of(Written({.scene = "body-pull",
                                                .settings = {{"camera", 0}},
                                                .width = 160,
                                                .height = 120,
                                                .frames = 1}));
    for (Eigen::Index id = 0; id < targets.positions[0].cols(); ++id) {
        const Vector3d beneath = targets.positions[0].col(id) - targets.positions[0].col(id % 45);
        CHECK((beneath - Vector3d(0, 0, targets.depths[static_cast<std::size_t>(id)])).norm() <
              1e-5);
    }
}

TEST_CASE("a body that only breathes moves rigidly, and by as much as it is said to") {
    const Targets targets = targets_of(Written({.scene = "body-rigid",
                                                .settings = {{"camera", 0}},
                                                .width = 160,
                                                .height = 120,
                                                .frames = 23}));
    double largest = 0;
    for (const Matrix3Xd& now : targets.positions) {
        CHECK(not_rigid(targets.positions[0], now) < 1e-5);
        largest = std::max(largest, (now - targets.positions[0]).col(22).norm());
    }
    CHECK(largest == doctest::Approx(3).epsilon(0.02));
}

TEST_CASE("held_motion.csv is the motion of what is held") {
    // Without a load all of the layer moves with its base, and the camera moves as well.
    const Written w({.scene = "body-layer",
                     .settings = {{"depth", 0}},
                     .width = 160,
                     .height = 120,
                     .frames = 12});
    const Targets targets = targets_of(w);
    const auto motions = held_motion(w);
    REQUIRE(motions.size() == 12);
    for (std::size_t frame = 0; frame < 12; ++frame) {
        const Matrix3Xd moved =
            (motions[frame].leftCols<3>() * targets.positions[0]).colwise() + motions[frame].col(3);
        CHECK((moved - targets.positions[frame]).cwiseAbs().maxCoeff() < 1e-5);
    }
    CHECK((motions[11].col(3) - motions[0].col(3)).norm() > 1);
}

TEST_CASE("the meshes of a body lie in the frame of its targets") {
    const Written w({.scene = "body-inclusion", .width = 160, .height = 120, .frames = 1});
    const Targets targets = targets_of(w);
    // The corner of the box that is the first point of the mesh, and the target above it.
    const auto first_point = [&](const char* name) {
        const std::string bytes = slurp(w.folder.path / name);
        const std::size_t end = bytes.find("end_header\n") + 11;
        REQUIRE(bytes.size() > end + 12);
        float p[3];
        std::memcpy(p, bytes.data() + end, sizeof p);
        return Vector3d(p[0], p[1], p[2]);
    };
    const auto from_middle = [&](const char* name) {
        return (first_point(name) - targets.positions[0].col(22)).norm();
    };
    CHECK(from_middle("body.ply") == doctest::Approx(std::hypot(55, 45)));
    CHECK(from_middle("held.ply") == doctest::Approx(Vector3d(56, 46, 49).norm()));
    const Vector3d corner = Vector3d(9, -4, 18) - 8 / std::sqrt(3.0) * Vector3d::Ones();
    CHECK(from_middle("inclusion.ply") == doctest::Approx(corner.norm()));
}

TEST_CASE("a sequence with a body leaves none of its files to the next one in the folder") {
    const Written w({.scene = "body-inclusion", .width = 160, .height = 120, .frames = 1});
    RenderOptions options;
    options.scene = "heartbeat";
    options.out_dir = w.folder.path.string();
    options.width = 160;
    options.height = 120;
    options.frames = 1;
    for (const char* name : {"targets.csv", "truth_deep.csv", "body.ply", "held.ply",
                             "held_motion.csv", "inclusion.ply"}) {
        CHECK(fs::exists(w.folder.path / name));
    }
    render_sequence(options, {});
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(w.folder.path)) {
        files += entry.is_regular_file() ? 1 : 0;
    }
    CHECK(files == 3);
}

TEST_CASE("the files of a body do not depend on threads") {
    const Written one({.scene = "body-stroke",
                       .width = 160,
                       .height = 120,
                       .frames = 9,
                       .seed = 3,
                       .threads = 1}),
        three({.scene = "body-stroke",
               .width = 160,
               .height = 120,
               .frames = 9,
               .seed = 3,
               .threads = 3});
    for (const char* name : {"targets.csv", "truth_deep.csv", "truth.csv"}) {
        CHECK(slurp(one.folder.path / name) == slurp(three.folder.path / name));
    }
}

TEST_CASE("a body that was computed for two Poisson's ratios refuses any other") {
    CHECK_THROWS_AS(Written({.scene = "body-organ",
                             .settings = {{"poisson", 0.4}},
                             .width = 160,
                             .height = 120,
                             .frames = 1}),
                    RenderUsageError);
}
