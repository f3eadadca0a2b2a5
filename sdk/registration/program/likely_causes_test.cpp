// Sizes and places tell why a registration fails.
#include "sdk/registration/program/likely_causes.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <random>

#include "sdk/registration/test_organ.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

MeshFile organ(float scale) {
    const TestMesh mesh = organ_mesh(3);
    MeshFile made;
    for (const float value : mesh.vertices) made.vertices.push_back(scale * value + 40 * scale);
    made.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
    return made;
}

// Vertices of the model and where a turn and a shift put them; each scaled, and turned before.
PairsFile pairs_of(const MeshFile& model, const Eigen::Vector3d& model_scale,
                   const Eigen::Vector3d& seen_scale) {
    const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, 3).normalized());
    PairsFile pairs;
    for (std::int64_t i = 0; i < 8; ++i) {
        const Eigen::Vector3d place =
            Eigen::Map<const Eigen::Vector3f>(&model.vertices[static_cast<std::size_t>(90 * i)])
                .cast<double>();
        const Eigen::Vector3d given = model_scale.cwiseProduct(place),
                              seen = seen_scale.cwiseProduct(turn * place +
                                                             Eigen::Vector3d(5, -500, 90));
        pairs.ids.push_back(i);
        pairs.model_xyz.insert(pairs.model_xyz.end(), given.begin(), given.end());
        pairs.seen_xyz.insert(pairs.seen_xyz.end(), seen.begin(), seen.end());
    }
    return pairs;
}

std::string said(const GivenPlaces& given) {
    std::string text;
    for (const std::string& cause : likely_causes(given)) text += cause + "\n";
    return text;
}

bool holds(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

const Eigen::Vector3d kSame(1, 1, 1), kLps(-1, -1, 1), kMirrored(-1, 1, 1);

}  // namespace

TEST_CASE("sizes that agree have no likely cause") {
    const MeshFile model = organ(1);
    const PairsFile pairs = pairs_of(model, kSame, kSame);
    CHECK(said({&model, model.vertices, &pairs}).empty());
    CHECK(said({}).empty());
}

TEST_CASE("a model in cm beside a surface in mm is told by its size, and a surface in m") {
    const MeshFile model = organ(1), small = organ(0.1f), metres = organ(0.001f);
    const std::string text = said({&small, model.vertices, nullptr});
    CHECK_MESSAGE(holds(text, "the model may be in another unit; see --unit"), text);
    CHECK_MESSAGE(holds(text, "The model's longest side is "), text);
    CHECK(holds(said({&model, metres.vertices, nullptr}), "the surface may be in another unit"));
}

TEST_CASE("pairs in another unit, mirrored, or of another frame are told apart") {
    const MeshFile model = organ(1);
    const PairsFile metres = pairs_of(model, kSame, 0.001 * kSame),
                    centimetres = pairs_of(model, 0.1 * kSame, kSame),
                    mirrored = pairs_of(model, kMirrored, kSame),
                    flipped = pairs_of(model, kLps, kSame);
    std::string text = said({nullptr, {}, &metres});
    CHECK_MESSAGE(holds(text, "1000 times nearer to each other in x, y, z than"), text);
    CHECK(holds(text, "may be in m; give mm"));
    text = said({nullptr, {}, &centimetres});
    CHECK_MESSAGE(holds(text, "10 times nearer to each other in model_x, model_y, model_z"), text);
    CHECK(holds(said({nullptr, {}, &mirrored}), "The pairs would fit a mirrored model, to 0.0 mm"));
    // These agree with each other, and not with the model.
    CHECK(said({nullptr, {}, &flipped}).empty());
    text = said({&model, model.vertices, &flipped});
    CHECK_MESSAGE(holds(text, "one in LPS and one in RAS"), text);
    PairsFile exchanged = pairs_of(model, kSame, kSame);
    std::swap(exchanged.model_xyz, exchanged.seen_xyz);
    text = said({&model, model.vertices, &exchanged});
    CHECK_MESSAGE(holds(text, "the columns may be exchanged"), text);
    PairsFile elsewhere = pairs_of(model, kSame, kSame);
    for (double& value : elsewhere.model_xyz) value += 900;
    CHECK(holds(said({&model, model.vertices, &elsewhere}), "of another frame or unit"));
}
