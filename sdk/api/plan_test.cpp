// Plans through the C API: what they add to targets, their files, and what is refused with which
// words. The sum of covariances with a turn: sdk/plan/plan_test.cpp.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "sdk/base/util/file_checksum.hpp"
#include "sdk/registration/elastic/test_deformations.hpp"
#include "sdk/testing/plane_tracker.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec::test;

namespace {

constexpr double kShift[3] = {5, -3, 40};  // template frame from model frame

template <class Struct>
Struct init() {
    Struct made;
    DEFREC_INIT(&made);
    return made;
}

// The model's frame is the template's, shifted; errors of 0.3 mm along each axis where it was seen.
defrec_registration registered(const std::vector<double>& model) {
    std::vector<double> seen(model), errors;
    for (size_t i = 0; i < seen.size(); ++i) seen[i] += kShift[i % 3];
    for (size_t i = 0; i < model.size() / 3; ++i)
        errors.insert(errors.end(), {0.09, 0, 0, 0.09, 0, 0.09});
    auto pairs = init<defrec_registration_pairs>();
    pairs.model_xyz = model.data();
    pairs.seen_xyz = seen.data();
    pairs.seen_covariance = errors.data();
    pairs.count = model.size() / 3;
    defrec_registration registration = nullptr;
    REQUIRE_OK(defrec_registration_from_pairs(&pairs, &registration));
    return registration;
}
defrec_registration accepted_registration() {
    return registered({-20, -15, 30, 15, -12, 32, -18, 14, 28, 17, 16, 36, 0, 0, 42});
}

// A patch of the plane, as the scan has it, with a tumour beneath and two targets.
struct Model {
    std::vector<float> vertices;
    std::vector<uint32_t> triangles{0, 1, 2, 1, 3, 2};
    std::vector<double> targets;
    std::vector<defrec_plan_part> parts{{"surface", 0, 2}, {"tumour", 1, 1}};
    std::vector<const char*> target_names{"", "tumour centre"};

    Model() {
        for (const double y : {-6.0, 6.0})
            for (const double x : {-8.0, 8.0})
                for (const double value : place(x, y, 0))
                    vertices.push_back(static_cast<float>(value));
        for (const double deeper : {0.0, 10.0})
            for (const double value : place(2, 1, deeper)) targets.push_back(value);
    }
    static std::vector<double> place(double x, double y, double deeper) {
        return {x - kShift[0], y - kShift[1], kDepth + kSlope * x + deeper - kShift[2]};
    }
    defrec_plan_desc desc() const {
        auto made = init<defrec_plan_desc>();
        made.vertices = vertices.data();
        made.vertex_count = vertices.size() / 3;
        made.triangles = triangles.data();
        made.triangle_count = triangles.size() / 3;
        made.parts = parts.data();
        made.part_count = parts.size();
        made.targets = targets.data();
        made.target_count = targets.size() / 3;
        made.target_names = target_names.data();
        return made;
    }
};

defrec_plan make_plan(defrec_template surface) {
    const Model model;
    const defrec_plan_desc desc = model.desc();
    defrec_registration registration = accepted_registration();
    defrec_plan plan = nullptr;
    REQUIRE_OK(defrec_plan_create(surface, registration, &desc, &plan));
    defrec_registration_destroy(registration);
    return plan;
}

defrec_plan_info info_of(defrec_plan plan) {
    auto info = init<defrec_plan_info>();
    REQUIRE_OK(defrec_plan_get(plan, &info));
    return info;
}

struct Moved {
    std::vector<double> xyz, covariance, expected_error;
    std::vector<uint8_t> status;
    explicit Moved(size_t count)
        : xyz(3 * count), covariance(6 * count), expected_error(count), status(count, 99) {}
};
Moved move_plan(defrec_job job, defrec_plan plan) {
    const size_t count = info_of(plan).point_count;
    Moved moved(count);
    REQUIRE_OK(defrec_job_move_plan(job, plan, count, moved.xyz.data(), moved.covariance.data(),
                                    moved.status.data(), moved.expected_error.data()));
    return moved;
}

// What a plan is compared with: its points as targets.
Moved move_targets(defrec_job job, defrec_template surface, defrec_plan plan) {
    const defrec_plan_info info = info_of(plan);
    Moved moved(info.point_count);
    defrec_targets targets = nullptr;
    REQUIRE_OK(defrec_targets_create(surface, info.template_xyz, info.point_count, &targets));
    REQUIRE_OK(defrec_job_move_targets(job, targets, info.point_count, moved.xyz.data(),
                                       moved.covariance.data(), moved.status.data(),
                                       moved.expected_error.data()));
    defrec_targets_destroy(targets);
    return moved;
}

std::string refusal(defrec_status status, defrec_status expected, defrec_plan made) {
    CHECK(status == expected);
    CHECK(made == nullptr);
    return defrec_last_error();
}

std::string bytes_of(const std::filesystem::path& path) {
    const std::vector<unsigned char> bytes = read_file(path);
    return {bytes.begin(), bytes.end()};
}
// With the checksum that fits what stands before it.
void write_summed(const std::filesystem::path& path, std::string bytes) {
    const size_t body = bytes.size() - sizeof(uint64_t);
    const uint64_t sum = defrec::file_checksum(bytes.data(), body);
    std::memcpy(bytes.data() + body, &sum, sizeof sum);
    write_file(path, bytes);
}

}  // namespace

TEST_CASE("a plan at rest") {
    const PlaneTracker tracker;
    defrec_plan plan = make_plan(tracker.surface());
    const defrec_plan_info info = info_of(plan);
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(info.vertex_count == 4);
    CHECK(info.triangle_count == 2);
    CHECK(info.target_count == 2);
    CHECK(info.point_count == 6);
    REQUIRE(info.part_count == 2);
    CHECK(std::string(info.parts[1].name) == "tumour");
    CHECK(info.parts[1].first_triangle == 1);
    CHECK(info.triangles[3] == 1);
    CHECK(std::string(info.target_names[0]).empty());
    CHECK(std::string(info.target_names[1]) == "tumour centre");

    const Model model;
    defrec_registration registration = accepted_registration();
    std::vector<double> points(model.vertices.begin(), model.vertices.end());
    points.insert(points.end(), model.targets.begin(), model.targets.end());
    std::vector<double> xyz(18), errors(6);
    REQUIRE_OK(defrec_registration_move_points(registration, points.data(), 6, xyz.data(), nullptr,
                                               errors.data()));
    CHECK(std::memcmp(xyz.data(), info.template_xyz, sizeof(double) * 18) == 0);
    CHECK(std::memcmp(errors.data(), info.registration_error_mm, sizeof(double) * 6) == 0);
    defrec_registration_destroy(registration);
    defrec_plan_destroy(plan);
}

TEST_CASE("a plan moves as targets do, with the error of the registration added") {
    PlaneTracker tracker;
    defrec_plan plan = make_plan(tracker.surface());
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    defrec_job job = tracker.track(1.5, -1);
    const Moved with = move_plan(job, plan), without = move_targets(job, tracker.surface(), plan);
    CHECK(with.xyz == without.xyz);
    CHECK(with.status == without.status);
    CHECK(with.status[0] == DEFREC_POINT_OBSERVED);
    CHECK(with.status[5] == DEFREC_POINT_EXTRAPOLATED);

    defrec_registration registration = accepted_registration();
    const Model model;
    std::vector<double> points(model.vertices.begin(), model.vertices.end()), xyz(18),
        of_registration(36);
    points.insert(points.end(), model.targets.begin(), model.targets.end());
    REQUIRE_OK(defrec_registration_move_points(registration, points.data(), 6, xyz.data(),
                                               of_registration.data(), nullptr));
    defrec_registration_destroy(registration);
    for (size_t i = 0; i < 6; ++i) {
        const double *sum = &with.covariance[6 * i], *tracking = &without.covariance[6 * i],
                     *added = &of_registration[6 * i];
        const double trace = added[0] + added[3] + added[5];
        CHECK(trace > 0.05);
        CHECK(with.expected_error[i] ==
              doctest::Approx(std::hypot(without.expected_error[i], std::sqrt(trace))));
        CHECK(std::sqrt(sum[0] + sum[3] + sum[5]) ==
              doctest::Approx(with.expected_error[i]).epsilon(1e-4));
        // The plane hardly turns.
        for (size_t k = 0; k < 6; ++k)
            CHECK(std::abs(sum[k] - tracking[k] - added[k]) < 0.05 * trace);
    }
    // Without what may be NULL.
    std::vector<double> place(18);
    REQUIRE_OK(defrec_job_move_plan(job, plan, 6, place.data(), nullptr, nullptr, nullptr));
    CHECK(place == with.xyz);
    defrec_job_release(job);

    job = tracker.lose();
    const Moved lost = move_plan(job, plan);
    for (const uint8_t status : lost.status) CHECK(status == DEFREC_POINT_UNKNOWN);
    defrec_job_release(job);
    defrec_plan_destroy(plan);
}

TEST_CASE("a plan that was saved and loaded is the same") {
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "liver.plan").string(),
                      copy = (folder.path() / "copy.plan").string();
    PlaneTracker tracker;
    defrec_plan plan = make_plan(tracker.surface()), loaded = nullptr;
    REQUIRE_OK(defrec_plan_save(plan, path.c_str()));
    REQUIRE_OK(defrec_plan_load(tracker.surface(), path.c_str(), &loaded));
    REQUIRE_OK(defrec_plan_save(loaded, copy.c_str()));
    CHECK(bytes_of(path) == bytes_of(copy));
    CHECK(std::string(info_of(loaded).parts[0].name) == "surface");
    CHECK(std::string(info_of(loaded).target_names[0]).empty());
    CHECK(std::string(info_of(loaded).target_names[1]) == "tumour centre");
    defrec_job job = tracker.track(1, 0);
    const Moved a = move_plan(job, plan), b = move_plan(job, loaded);
    CHECK(a.xyz == b.xyz);
    CHECK(a.covariance == b.covariance);
    CHECK(a.expected_error == b.expected_error);
    defrec_job_release(job);
    defrec_plan_destroy(loaded);

    // Another run with the same first view.
    PlaneTracker again;
    loaded = nullptr;
    REQUIRE_OK(defrec_plan_load(again.surface(), path.c_str(), &loaded));
    job = tracker.track(1, 0);
    double xyz[18];
    CHECK(defrec_job_move_plan(job, loaded, 6, xyz, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "the plan was made for another template"));
    defrec_job_release(job);
    defrec_plan_destroy(loaded);
    defrec_plan_destroy(plan);
}

TEST_CASE("a plan of a deformed model: its points, their errors, and its file") {
    // An organ that is twisted in front of the camera; the model is the organ as it was.
    const defrec::TestMesh mesh = defrec::organ_mesh(4);
    std::mt19937 random(21);
    const defrec::Displaced by =
        defrec::deformation_of(defrec::TestDeformation::kTwisted, mesh, 12, random);
    const defrec::Pose truth = defrec::organ_pose(random, 140, 0.2);
    const defrec::TestView view =
        defrec::TestCamera(defrec::displaced(mesh, by), truth, {}).view(mesh, random);
    auto given = init<defrec_registration_desc>();
    given.flags = DEFREC_REGISTRATION_ELASTIC;
    given.model_vertices = mesh.vertices.data();
    given.model_vertex_count = mesh.vertices.size() / 3;
    given.model_triangles = mesh.triangles.data();
    given.model_triangle_count = mesh.triangles.size() / 3;
    given.seen_vertices = view.places.data();
    given.seen_covariances = view.covariances.data();
    given.seen_count = view.places.size() / 3;
    const defrec::Pose start = defrec::off_by(truth, Eigen::Vector3d(0, 0, 0), 0.1, 5, random);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            given.start[4 * row + column] = start.rotation(row, column);
        given.start[4 * row + 3] = start.translation[row];
    }
    PlaneTracker tracker;
    const TestContext context;
    defrec_registration registration = nullptr;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &given, &registration));
    auto found = init<defrec_registration_info>();
    REQUIRE_OK(defrec_registration_get(registration, &found));
    INFO(found.deformation_text, " ", found.reason);
    REQUIRE(found.deformation == DEFREC_DEFORMATION_APPLIED);
    CHECK(found.deformed_max_mm > found.deformed_rms_mm);
    CHECK(found.deformed_rms_mm > 1);
    CHECK(found.largest_strain > 0.01);
    CHECK(found.rigid_robust_mm > found.robust_mm);

    const std::vector<double> targets{60, 0, -20, -60, 10, -20};
    auto desc = init<defrec_plan_desc>();
    desc.targets = targets.data();
    desc.target_count = 2;
    desc.vertices = mesh.vertices.data();
    desc.vertex_count = 30;
    defrec_plan plan = nullptr, loaded = nullptr;
    REQUIRE_OK(defrec_plan_create(tracker.surface(), registration, &desc, &plan));
    const defrec_plan_info info = info_of(plan);
    CHECK(info.deformed == 1);
    double xyz[6], covariance[12], errors[2];
    REQUIRE_OK(
        defrec_registration_move_points(registration, targets.data(), 2, xyz, covariance, errors));
    CHECK(std::memcmp(xyz, info.template_xyz + 90, sizeof xyz) == 0);
    CHECK(std::memcmp(errors, info.registration_error_mm + 30, sizeof errors) == 0);
    // Not where the transform alone would put it, but nearer to where it is.
    for (size_t i = 0; i < 2; ++i) {
        const Eigen::Map<const Eigen::Vector3d> target(&targets[3 * i]);
        Eigen::Vector3d rigid;
        for (int row = 0; row < 3; ++row)
            rigid[row] = info.transform[4 * row] * target.x() +
                         info.transform[4 * row + 1] * target.y() +
                         info.transform[4 * row + 2] * target.z() + info.transform[4 * row + 3];
        const Eigen::Vector3d is = truth * by(target);
        const Eigen::Vector3d placed = Eigen::Map<const Eigen::Vector3d>(xyz + 3 * i);
        CHECK((placed - is).norm() < 0.7 * (rigid - is).norm());
    }

    const TemporaryFolder folder;
    const std::string path = (folder.path() / "deformed.plan").string(),
                      bad = (folder.path() / "bad.plan").string();
    REQUIRE_OK(defrec_plan_save(plan, path.c_str()));
    REQUIRE_OK(defrec_plan_load(tracker.surface(), path.c_str(), &loaded));
    CHECK(std::memcmp(info_of(loaded).template_xyz, info.template_xyz, 96 * sizeof(double)) == 0);
    CHECK(info_of(loaded).deformed == 1);
    defrec_job job = tracker.track(1, 0);
    const Moved moved = move_plan(job, plan), again = move_plan(job, loaded),
                as_targets = move_targets(job, tracker.surface(), plan);
    CHECK(moved.xyz == again.xyz);
    CHECK(moved.xyz == as_targets.xyz);
    for (const size_t i : {0, 31})
        if (std::isfinite(moved.expected_error[i])) {
            CHECK(moved.expected_error[i] == again.expected_error[i]);
            CHECK(moved.expected_error[i] >= info.registration_error_mm[i]);
        }
    defrec_job_release(job);
    for (size_t i = 0; i < 2; ++i)  // nobody named them
        CHECK(std::string(info_of(loaded).target_names[i]).empty());
    // A covariance that is none stands six numbers before the end: parts, names, the checksum.
    std::string bytes = bytes_of(path);
    const double negative = -1;
    std::memcpy(bytes.data() + bytes.size() - 8 * (6 + 1 + 1 + 1), &negative, sizeof negative);
    write_summed(bad, bytes);
    defrec_plan none = nullptr;
    CHECK(contains(
        refusal(defrec_plan_load(tracker.surface(), bad.c_str(), &none), DEFREC_ERROR_IO, none),
        "deformed point 31 has a covariance that is none"));
    defrec_plan_destroy(plan);
    defrec_plan_destroy(loaded);
    defrec_registration_destroy(registration);
}

TEST_CASE("a plan's file of another template, damaged, cut short or of NaN") {
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "liver.plan").string(),
                      bad = (folder.path() / "bad.plan").string();
    const PlaneTracker tracker;
    defrec_plan plan = make_plan(tracker.surface()), none = nullptr;
    REQUIRE_OK(defrec_plan_save(plan, path.c_str()));
    const std::string bytes = bytes_of(path);
    const auto load = [&] { return defrec_plan_load(tracker.surface(), bad.c_str(), &none); };

    // Cut short everywhere; the checksum would tell as well.
    for (size_t size = 0; size < bytes.size(); size += size < 100 ? 1 : 13) {
        write_file(bad, bytes.substr(0, size));
        CAPTURE(size);
        CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "bad.plan"));
    }
    // One bit.
    for (size_t at = 12; at < bytes.size(); at += 7) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
        write_file(bad, damaged);
        CAPTURE(at);
        refusal(load(), DEFREC_ERROR_IO, none);
    }
    write_file(bad, bytes + "x");
    CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "something follows its end"));
    std::string other = bytes;
    other[8] = 1;
    write_summed(bad, other);
    CHECK(contains(refusal(load(), DEFREC_ERROR_VERSION, none), "layout 1, this library reads 3"));
    // The transform follows the fingerprint and the verdict.
    constexpr size_t kFirstNumber = 12 + 8 + 64 + 4;
    other = bytes;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::memcpy(other.data() + kFirstNumber, &nan, sizeof nan);
    write_summed(bad, other);
    CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "transform is not finite"));
    other = bytes;
    other[kFirstNumber - 4] = 9;
    write_summed(bad, other);
    CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "its verdict is out of range"));
    other = bytes;
    other[12 + 8] = static_cast<char>(other[12 + 8] == '0' ? '1' : '0');
    write_summed(bad, other);
    CHECK(contains(refusal(load(), DEFREC_ERROR_ARGUMENT, none), "made for another template"));

    write_file(bad, "solid liver");
    CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "does not begin as one"));
    std::filesystem::remove(bad);
    CHECK(contains(refusal(load(), DEFREC_ERROR_IO, none), "is not a file"));
    CHECK(contains(refusal(defrec_plan_load(tracker.surface(), "", &none), DEFREC_ERROR_IO, none),
                   "the path of the plan is empty"));
    CHECK(defrec_plan_save(plan, (folder.path() / "none" / "a.plan").string().c_str()) ==
          DEFREC_ERROR_IO);
    CHECK(defrec_plan_save(plan, folder.path().string().c_str()) == DEFREC_ERROR_IO);
    CHECK(contains(defrec_last_error(), "the plan cannot be written"));
    CHECK(bytes_of(path) == bytes);
    defrec_plan_destroy(plan);
}

TEST_CASE("row 203: names that targets of a plan cannot have") {
    const PlaneTracker tracker;
    const Model model;
    defrec_registration registration = accepted_registration();
    defrec_plan none = nullptr;
    const std::string longest(255, 'x'), too_long(256, 'x');
    const auto create = [&](const char* first, const char* second) {
        const char* const names[] = {first, second};
        defrec_plan_desc desc = model.desc();
        desc.target_names = names;
        return defrec_plan_create(tracker.surface(), registration, &desc, &none);
    };
    const auto refused = [&](const char* first, const char* second) {
        return refusal(create(first, second), DEFREC_ERROR_ARGUMENT, none);
    };
    CHECK(contains(refused("vessel", "vessel"),
                   "targets[1].name is \"vessel\", which is that of another target"));
    CHECK(contains(refused("", too_long.c_str()), "targets[1].name has 256 bytes, 0 to 255"));
    CHECK(contains(refused(nullptr, "vessel"), "a target's name is NULL"));
    CHECK(contains(refused("vessel", "v\xFF"), "targets[1].name is not UTF-8"));
    CHECK(contains(refused("abc\xE2\x82", "vessel"), "targets[0].name is not UTF-8"));
    CHECK(contains(refused("\x1B[31mred", "\x1B[31mred"),
                   "targets[1].name is \"?[31mred\", which is that of another target"));
    REQUIRE_OK(create(longest.c_str(), ""));
    CHECK(info_of(none).target_names[0] == longest);
    defrec_plan_destroy(none);
    none = nullptr;
    REQUIRE_OK(create("", ""));
    // A file of two alike is refused as well.
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "named.plan").string();
    defrec_plan_destroy(none);
    none = nullptr;
    REQUIRE_OK(create("vessel a", "vessel b"));
    REQUIRE_OK(defrec_plan_save(none, path.c_str()));
    defrec_plan_destroy(none);
    none = nullptr;
    std::string bytes = bytes_of(path);
    bytes[bytes.rfind("vessel b") + 7] = 'a';
    write_summed(path, bytes);
    CHECK(contains(
        refusal(defrec_plan_load(tracker.surface(), path.c_str(), &none), DEFREC_ERROR_IO, none),
        "which is that of another target"));
    bytes[bytes.rfind("vessel a") + 7] = '\xFF';
    write_summed(path, bytes);
    CHECK(contains(
        refusal(defrec_plan_load(tracker.surface(), path.c_str(), &none), DEFREC_ERROR_IO, none),
        "is not UTF-8"));
    bytes[bytes.rfind("vessel ") + 7] = 'a';
    // More names than targets.
    bytes[bytes.rfind("vessel a") - 32] = 3;
    write_summed(path, bytes);
    refusal(defrec_plan_load(tracker.surface(), path.c_str(), &none), DEFREC_ERROR_IO, none);
    defrec_registration_destroy(registration);
}

TEST_CASE("what no plan is made of") {
    const PlaneTracker tracker;
    const Model model;
    defrec_registration good = accepted_registration(),
                        line = registered({0, 0, 0, 10, 0, 0, 20, 0, 0, 35, 0, 0});
    defrec_plan none = nullptr;
    const auto create = [&](defrec_registration registration, const defrec_plan_desc& desc) {
        return refusal(defrec_plan_create(tracker.surface(), registration, &desc, &none),
                       DEFREC_ERROR_ARGUMENT, none);
    };
    CHECK(contains(create(line, model.desc()), "the registration is not accepted"));
    defrec_plan_desc desc = model.desc();
    desc.flags = DEFREC_PLAN_LOOKED_AT;
    REQUIRE_OK(defrec_plan_create(tracker.surface(), line, &desc, &none));
    const defrec_plan_info info = info_of(none);
    CHECK(info.verdict == DEFREC_VERDICT_UNDETERMINED);
    CHECK(info.registration_error_mm[5] > 100);
    defrec_plan_destroy(none);
    none = nullptr;

    desc = model.desc();
    desc.vertices = nullptr;
    CHECK(contains(create(good, desc), "desc.vertices is NULL"));
    desc = model.desc();
    desc.flags = 2;
    CHECK(contains(create(good, desc), "desc.flags"));
    desc = model.desc();
    const defrec_plan_part nameless{nullptr, 0, 1};
    desc.parts = &nameless;
    desc.part_count = 1;
    CHECK(contains(create(good, desc), "a part's name is NULL"));
    const defrec_plan_part wrongly_named{"tumour\x80", 0, 1};
    desc.parts = &wrongly_named;
    CHECK(contains(create(good, desc), "parts[0].name is not UTF-8"));
    Model wrong;
    wrong.vertices[0] = std::numeric_limits<float>::quiet_NaN();
    CHECK(contains(create(good, wrong.desc()), "a vertex is not finite"));
    wrong = Model();
    wrong.triangles[0] = 4;
    CHECK(contains(create(good, wrong.desc()), "a triangle has vertex 4, there are 4"));

    defrec_plan plan = make_plan(tracker.surface());
    double xyz[18];
    CHECK(defrec_plan_get(reinterpret_cast<defrec_plan>(good), nullptr) == DEFREC_ERROR_HANDLE);
    CHECK(contains(defrec_last_error(), "a plan is expected"));
    PlaneTracker other;
    defrec_job job = other.track(0, 0);
    CHECK(defrec_job_move_plan(job, plan, 5, xyz, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "count is 5, the plan has 6 points"));
    CHECK(defrec_job_move_plan(job, plan, 6, nullptr, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    defrec_job_release(job);
    defrec_plan_destroy(plan);
    CHECK(defrec_plan_save(plan, "x") == DEFREC_ERROR_HANDLE);
    defrec_plan_destroy(nullptr);
    defrec_registration_destroy(line);
    defrec_registration_destroy(good);
}
