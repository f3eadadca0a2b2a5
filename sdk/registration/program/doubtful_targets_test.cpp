// Notes on targets that do not belong to the model.
#include "sdk/registration/program/doubtful_targets.hpp"

#include <doctest/doctest.h>

#include "sdk/io/test_refusal.hpp"
#include "sdk/registration/test_organ.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

using Place = std::array<double, 3>;

// About 190 mm long; its middle lies here.
MeshFile organ_at(const Place& middle) {
    const TestMesh mesh = organ_mesh(3);
    MeshFile made;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        made.vertices.push_back(mesh.vertices[i] + static_cast<float>(middle[i % 3]));
    made.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
    return made;
}

// Within the organ, and one 50 mm beneath it.
std::vector<ModelTarget> targets_at(const Place& middle, const Place& scale) {
    std::vector<ModelTarget> made;
    for (int i = 0; i < 8; ++i) {
        const Place place{middle[0] + 9 * i - 30, middle[1] + 4 * i - 15, middle[2] - 16 * i};
        made.push_back({std::string("t").append(std::to_string(i)),
                        {scale[0] * place[0], scale[1] * place[1], scale[2] * place[2]}});
    }
    return made;
}

// To (-20, 10, 150) of the camera.
std::array<double, 12> to_camera(const Place& middle) {
    return {1, 0, 0, -20 - middle[0], 0, 1, 0, 10 - middle[1], 0, 0, 1, 150 - middle[2]};
}

constexpr Place kSame{1, 1, 1}, kMetres{0.001, 0.001, 0.001}, kCm{0.1, 0.1, 0.1}, kLps{-1, -1, 1},
    kScan{205, -160, 340}, kOwn{3, -2, 4};

std::string said(const Place& middle, const std::vector<ModelTarget>& targets) {
    const MeshFile model = organ_at(middle);
    return doubtful_targets({targets, &model, nullptr, to_camera(middle)});
}

}  // namespace

TEST_CASE("targets in and beneath the model are not doubted, nor are single ones beside it") {
    for (const Place& middle : {kScan, kOwn}) {
        std::vector<ModelTarget> targets = targets_at(middle, kSame);
        CHECK(said(middle, targets).empty());
        targets[0].place[1] += 900;
        CHECK(said(middle, targets).empty());
        CHECK(said(middle, {}).empty());
    }
    CHECK(said(kOwn, {{"middle", {0, 0, 0}}}).empty());
    CHECK(said(kOwn, {{"tumour", {1, 2, -1}}}).empty());
    const std::vector<ModelTarget> targets = targets_at(kScan, kMetres);
    CHECK(doubtful_targets({targets, nullptr, nullptr, to_camera(kScan)}).empty());
}

TEST_CASE("targets in another unit or frame than the model are told, with the likely cause") {
    const std::string metres = said(kScan, targets_at(kScan, kMetres));
    CHECK_SAYS(metres, "8 of 8 targets lie more than 60 mm beside the model. Times 1000 they lie");
    CHECK_SAYS(metres, "in metres; give mm");
    CHECK_SAYS(said(kScan, targets_at(kScan, kCm)), "may be in cm; give mm");
    CHECK_SAYS(said(kScan, targets_at(kScan, kLps)), "one in LPS and one in RAS");
    CHECK_SAYS(said(kScan, targets_at({-20, 10, 150}, kSame)), "in the camera's frame");
    CHECK_SAYS(said(kScan, targets_at({-20, 10, 150}, kMetres)), "in metres and registered");
    CHECK_SAYS(said(kScan, targets_at({-900, 0, 0}, kSame)), "Give mm in the model's frame.");
    // In the model, as its origin is.
    CHECK_SAYS(said(kOwn, targets_at(kOwn, kMetres)),
               "All 8 targets lie within 0.11 mm of the origin of the model's frame. Times 1000");
}

TEST_CASE("without a model targets are compared with the landmarks") {
    PairsFile pairs;
    for (const Place& at : {Place{0, 0, -50}, {60, 10, -30}, {-40, 30, -35}, {10, -45, -20}})
        for (std::size_t axis = 0; axis < 3; ++axis)
            pairs.model_xyz.push_back(at[axis] + kScan[axis]);
    const auto of_pairs = [&](const Place& scale) {
        const std::vector<ModelTarget> targets = targets_at(kScan, scale);
        return doubtful_targets({targets, nullptr, &pairs, to_camera(kScan)});
    };
    CHECK(of_pairs(kSame).empty());
    CHECK_SAYS(of_pairs(kMetres), "more than 100 mm beside the pairs. Times 1000 they lie there");
}

TEST_CASE("targets behind the camera are told with their names") {
    const std::vector<ModelTarget> targets = targets_at(kOwn, kSame);
    std::vector<Place> places(targets.size(), {0, 0, 90});
    CHECK(targets_behind_camera(targets, places).empty());
    places[2][2] = -4;
    CHECK_SAYS(targets_behind_camera(targets, places),
               "1 of 8 targets lie behind the camera where the registration puts them (t2): no");
    places.assign(targets.size(), {0, 0, -90});
    CHECK_SAYS(targets_behind_camera(targets, places), "(t0, t1, t2, t3, t4, ...)");
}
