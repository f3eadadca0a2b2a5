// The shapes of an elastic body: what they are orthogonal to, what they hold, and which models have
// none.
#include "sdk/registration/elastic/force_modes.hpp"

#include <doctest/doctest.h>

#include <Eigen/QR>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/elastic/test_deformations.hpp"

using namespace defrec;

namespace {

const TestMesh& organ() {
    static const TestMesh made = organ_mesh(3);
    return made;
}

ModelSurface surface_of(const TestMesh& mesh) { return {mesh.vertices, mesh.triangles, "organ"}; }

const ForceModes& organ_modes() {
    static const ForceModes made(surface_of(organ()), nullptr);
    return made;
}

std::string refusal_of(const TestMesh& mesh) {
    try {
        ForceModes(surface_of(mesh), nullptr);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "accepted";
}

// The modes, three rows for each vertex.
Eigen::MatrixXd at_vertices() {
    const auto count = static_cast<Eigen::Index>(organ().vertices.size() / 3);
    Eigen::MatrixXd made(3 * count, organ_modes().count());
    for (Eigen::Index i = 0; i < count; ++i)
        made.middleRows<3>(3 * i) = organ_modes().at(organ().vertex(static_cast<size_t>(i)));
    return made;
}

}  // namespace

TEST_CASE("modes: the softest first, about 1 mm over the surface each") {
    const ForceModes& modes = organ_modes();
    CHECK(modes.count() > 60);
    CHECK(modes.stiffness()[0] > 0);
    for (Eigen::Index i = 1; i < modes.count(); ++i)
        CHECK(modes.stiffness()[i] >= modes.stiffness()[i - 1]);
    const Eigen::MatrixXd all = at_vertices();
    for (const Eigen::Index mode : {0, 1, 5, 20})
        CHECK(std::sqrt(3 * all.col(mode).squaredNorm() / static_cast<double>(all.rows())) ==
              doctest::Approx(1).epsilon(0.25));
    // No two are alike over the surface.
    CHECK(std::abs(all.col(0).dot(all.col(1))) < 0.25 * all.col(0).norm() * all.col(1).norm());
}

TEST_CASE("modes hold bending, twisting, waves and pushes, which do not come from them") {
    const Eigen::MatrixXd shapes = at_vertices();
    const Eigen::Index rows = shapes.rows();
    Eigen::MatrixXd basis(rows, shapes.cols() + 6);
    basis.rightCols(shapes.cols()) = shapes;
    for (Eigen::Index i = 0; i < rows / 3; ++i)
        basis.block<3, 6>(3 * i, 0) = place_shift(organ().vertex(static_cast<size_t>(i)));
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(basis);
    for (const TestDeformation kind : {TestDeformation::kBent, TestDeformation::kTwisted,
                                       TestDeformation::kBreathing, TestDeformation::kPushed}) {
        CAPTURE(name_of(kind));
        std::mt19937 random(3);
        const Displaced by = deformation_of(kind, organ(), 8, random);
        Eigen::VectorXd shifts(rows);
        for (Eigen::Index i = 0; i < rows / 3; ++i) {
            const Eigen::Vector3d place = organ().vertex(static_cast<size_t>(i));
            shifts.segment<3>(3 * i) = by(place) - place;
        }
        const Eigen::VectorXd rest = shifts - basis * fit.solve(shifts);
        CHECK(shifts.cwiseAbs().maxCoeff() > 4);
        CHECK(rest.norm() < 0.15 * shifts.norm());
    }
}

TEST_CASE("a place outside moves with the nearest of the body; strains are those of the cells") {
    const ForceModes& modes = organ_modes();
    const Eigen::Vector3d beside(0, 0, -120);
    CHECK(modes.at(beside).norm() > 0);
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(modes.count());
    CHECK(modes.largest_strain(modes.node_shifts(coefficients)) == 0);
    coefficients[0] = 3;
    const double strain = modes.largest_strain(modes.node_shifts(coefficients));
    CHECK(strain > 0.01);
    CHECK(strain < 0.3);
    CHECK(modes.rms_strain(modes.node_shifts(coefficients)) < 2 * strain);
    CHECK(modes.rms_strain(modes.node_shifts(coefficients)) > 0.1 * strain);
}

TEST_CASE("row 193: a model that is not closed, or of two bodies, is not deformed") {
    TestMesh open = organ();
    open.triangles.resize(open.triangles.size() - 3);
    const std::string not_closed = refusal_of(open);
    CHECK_MESSAGE(not_closed.starts_with("the model is not closed"), not_closed);

    TestMesh two = organ();
    const auto shift = static_cast<uint32_t>(two.vertices.size() / 3);
    for (size_t i = 0; i < shift; ++i) two.add(organ().vertex(i) + Eigen::Vector3d(400, 0, 0));
    for (const uint32_t vertex : organ().triangles) two.triangles.push_back(vertex + shift);
    const std::string apart = refusal_of(two);
    CHECK_MESSAGE(apart.starts_with("the model consists of 2 bodies"), apart);
    CHECK(refusal_of(organ()) == "accepted");
}
