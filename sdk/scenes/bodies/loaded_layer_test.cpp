// The fields of a loaded half-space and layer: balance of forces inside, the conditions at the
// surface and at the base, and closed forms where there are any.
#include "sdk/scenes/bodies/loaded_layer.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

using defrec::cli::BodyLoad;
using defrec::cli::GaussianLoad;
using defrec::cli::kBodyDepths;
using defrec::cli::Layer;
using defrec::cli::LoadedLayer;
using defrec::cli::RadialParts;
using defrec::cli::WaveResponse;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kWidth = 6;

/// A pressure and a traction along x, both of unit height at the middle.
struct Field {
    GaussianLoad load;
    double press, drag;

    Vector3d at(const Vector3d& p) const {
        const double r = p.head<2>().norm();
        const double c = r > 0 ? p.x() / r : 1, s = r > 0 ? p.y() / r : 0;
        const RadialParts parts = load.at(r, p.z());
        return {press * parts.press_out * c +
                    drag * (parts.drag_even - parts.drag_twice * (c * c - s * s)),
                press * parts.press_out * s - drag * parts.drag_twice * 2 * s * c,
                press * parts.press_down - drag * parts.drag_once * c};
    }

    /// d u_i / d x_j, differences of the fourth order.
    Matrix3d gradient(const Vector3d& p) const {
        constexpr double kStep = 0.05;
        Matrix3d gradient;
        for (int j = 0; j < 3; ++j) {
            const Vector3d step = kStep * Vector3d::Unit(j);
            gradient.col(j) =
                (8 * (at(p + step) - at(p - step)) - at(p + 2 * step) + at(p - 2 * step)) /
                (12 * kStep);
        }
        return gradient;
    }

    /// The shear modulus is 1/2.
    Matrix3d stress(const Vector3d& p, double poisson) const {
        const Matrix3d g = gradient(p);
        return 0.5 * (g + g.transpose()) +
               poisson / (1 - 2 * poisson) * g.trace() * Matrix3d::Identity();
    }

    /// Force on a unit of volume, by which balance is missed.
    Vector3d imbalance(const Vector3d& p, double poisson) const {
        constexpr double kStep = 0.1;
        Vector3d force = Vector3d::Zero();
        for (int j = 0; j < 3; ++j) {
            const Vector3d step = kStep * Vector3d::Unit(j);
            force += (8 * (stress(p + step, poisson) - stress(p - step, poisson)).col(j) -
                      (stress(p + 2 * step, poisson) - stress(p - 2 * step, poisson)).col(j)) /
                     (12 * kStep);
        }
        return force;
    }
};

const Vector3d kPlaces[] = {{0.5, 0.3, 2}, {4, -3, 6}, {-9, 5, 11}, {2, 14, 20}};

}  // namespace

TEST_CASE("inside a loaded body all forces balance") {
    for (const double thickness : {0.0, 35.0}) {
        for (const double poisson : {0.3, 0.49}) {
            CAPTURE(thickness);
            CAPTURE(poisson);
            const Field field{GaussianLoad({poisson, thickness}, kWidth), 1, 0.6};
            for (const Vector3d& place : kPlaces) {
                // The stresses are 0.1 to 1 and fall off within some mm.
                CHECK(field.imbalance(place, poisson).norm() < 2e-6);
            }
        }
    }
}

TEST_CASE("the surface carries the load and nothing else") {
    for (const double thickness : {0.0, 35.0}) {
        for (const double poisson : {0.3, 0.49}) {
            CAPTURE(thickness);
            CAPTURE(poisson);
            const Field field{GaussianLoad({poisson, thickness}, kWidth), 1, 0.6};
            for (const double x : {0.0, 3.0, 8.0, 25.0}) {
                const Vector3d place(x, 0.5 * x, 0);
                const double load = std::exp(-place.squaredNorm() / (2 * kWidth * kWidth));
                const Vector3d traction = -field.stress(place, poisson).col(2);
                CHECK((traction - load * Vector3d(0.6, 0, 1)).norm() < 1e-5);
            }
        }
    }
}

TEST_CASE("the base of a layer does not move, and far beneath nothing does") {
    const Field layer{GaussianLoad({0.45, 35}, kWidth), 1, 0.6};
    const Field half_space{GaussianLoad({0.45, 0}, kWidth), 1, 0.6};
    const Field deep{GaussianLoad({0.45, 1500}, kWidth), 1, 0.6};
    const double peak = half_space.at({0, 0, 0}).norm();
    for (const double x : {0.0, 4.0, 30.0}) {
        CHECK(layer.at({x, -x, 35}).norm() < 1e-9 * peak);
        CHECK(layer.at({x, -x, 0}).norm() > 1e-4 * peak);
        CHECK((deep.at({x, -x, 5}) - half_space.at({x, -x, 5})).norm() < 0.02 * peak);
    }
}

TEST_CASE("a half-space answers to waves and to a Gaussian load as the closed forms say") {
    const double n = 0.4, k = 0.3, z = 5, decay = std::exp(-k * z);
    const WaveResponse response({n, 0}, k);
    CHECK(response.to_pressure(z).down == doctest::Approx((2 * (1 - n) + k * z) * decay / k));
    CHECK(response.to_pressure(z).along == doctest::Approx(-((1 - 2 * n) - k * z) * decay / k));
    CHECK(response.to_traction(0).along == doctest::Approx(2 * (1 - n) / k));
    // Betti: what a pressure does along a wave a traction does downwards.
    CHECK(response.to_traction(0).down == doctest::Approx(response.to_pressure(0).along));
    const double middle = 2 * (1 - n) * kWidth * std::sqrt(0.5 * std::numbers::pi);
    CHECK(GaussianLoad({n, 0}, kWidth).at(0, 0).press_down == doctest::Approx(middle));
}

TEST_CASE("the table of a body is the integrals, scaled to 1 mm at the load's middle") {
    for (const double thickness : {0.0, 35.0}) {
        const Layer layer{0.3, thickness};
        const LoadedLayer body(layer, kWidth);
        const GaussianLoad load(layer, kWidth);
        const RadialParts middle = load.at(0, 0);
        const Field field{load, 7 / middle.press_down, 3 / middle.drag_even};
        BodyLoad given{.centre = {3, -2}, .press = 7, .drag = {3, 0}};
        CHECK((body.displacement(given, 3, -2, 0) - Vector3d(3, 0, 7)).norm() < 1e-9);
        for (std::size_t depth = 0; depth < (thickness > 0 ? 6 : kBodyDepths.size()); ++depth) {
            for (const double x : {0.2, 2.3, 7.7, 31.1, 80.0}) {
                const Vector3d moved = body.displacement(given, 3 + x, -2 - 0.7 * x, depth);
                CHECK((moved - field.at({x, -0.7 * x, kBodyDepths[depth]})).norm() < 1e-3);
            }
        }
        // Along y the same field, turned.
        const Vector3d along_x = body.displacement(given, 3 + 5, -2 + 4, 2);
        given.drag = {0, 3};
        const Vector3d along_y = body.displacement(given, 3 - 4, -2 + 5, 2);
        CHECK((along_y - Vector3d(-along_x.y(), along_x.x(), along_x.z())).norm() < 1e-9);
    }
}
