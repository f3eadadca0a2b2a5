// The terms of stage lm: kernels are the integrals of their weights, and every Jacobian is the
// derivative of its residual.
#include "backends/shared/lm_terms.hpp"

#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <random>

#include "backends/shared/levenberg_marquardt.hpp"

using namespace defrec;

namespace {

using V = Vec3<double>;

struct Random {
    std::mt19937 engine{11};
    double operator()(double size) {
        return size * std::uniform_real_distribution<double>(-1, 1)(engine);
    }
    V vector(double size) { return {(*this)(size), (*this)(size), (*this)(size)}; }
    NodePose<double> pose() { return {rotation_from_vector(vector(0.8)), vector(4) + V{0, 0, 80}}; }
};

// A step along one of the six increments of a control point, on top of what step holds.
NodePose<double> nudged(const NodePose<double>& pose, int which, double size) {
    double step[6] = {};
    step[which] = size;
    return moved(pose, step);
}

double component(V v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }

}  // namespace

TEST_CASE("a kernel's cost is the integral of twice the distance times its weight") {
    for (const double inverse_a : {0.0, 0.1, 0.4}) {
        const double inverse_c2 = 1 / 9.0;
        double integral = 0;
        constexpr double kStep = 1e-4;
        for (double d = 0; d < 5; d += kStep) {
            const double middle = d + kStep / 2;
            integral +=
                2 * middle * ramped_tukey(middle * middle, inverse_a, inverse_c2).weight * kStep;
            const double end = d + kStep;
            CHECK(ramped_tukey(end * end, inverse_a, inverse_c2).cost ==
                  doctest::Approx(integral).epsilon(1e-6));
        }
    }
    for (const double d : {0.0, 0.5, 2.9, 3.0, 8.0}) {
        const auto plain = tukey(d * d, 1 / 9.0), ramped = ramped_tukey(d * d, 0.0, 1 / 9.0);
        CHECK(plain.cost == doctest::Approx(ramped.cost));
        CHECK(plain.weight == doctest::Approx(ramped.weight));
    }
    CHECK(ramped_tukey(4.0, 0.25, 1e-12).weight ==
          doctest::Approx(0.5));  // the paper's 1 - d / (5 H)
}

TEST_CASE_TEMPLATE("a residual beyond the kernel has no weight, and costs what one at its end does",
                   T, float, double) {
    const T infinity = std::numeric_limits<T>::infinity(),
            nan = std::numeric_limits<T>::quiet_NaN();
    for (T c = T(0.1); c < T(60); c *= T(1.037)) {
        const T inverse_c2 = 1 / (c * c);
        const T beyond = c * c * (1 + 4 * std::numeric_limits<T>::epsilon());
        for (const T squared : {beyond, 2 * beyond, 1000 * beyond, infinity, nan}) {
            const auto kernel = ramped_tukey(squared, T(0), inverse_c2);
            CHECK(kernel.weight == T(0));
            CHECK(kernel.cost == doctest::Approx(double(c * c / 3)).epsilon(1e-5));
            // The ramp ends first.
            const auto ramped = ramped_tukey(squared, 2 / c, inverse_c2);
            CHECK(ramped.weight == T(0));
            CHECK(ramped.cost == ramped_tukey(beyond, 2 / c, inverse_c2).cost);
        }
    }
}

TEST_CASE("the gradient of a sighting is the derivative of its residual by the point") {
    Random random;
    const defrec_camera camera{500, 500, 240, 130, 4.6, 0};
    defrec_patch_observation seen{};
    seen.u = 250 * 256;
    seen.v = 140 * 256;
    seen.valid = 1;
    seen.information[0] = 0.7f;
    seen.information[1] = 0.3f;
    seen.information[2] = 0.5f;
    Sighting<double> patch;
    REQUIRE(patch_sighting(camera, seen, patch));
    for (const Sighting<double>& sighting : {patch, match_sighting(V{3, -2, 81})})
        for (int trial = 0; trial < 20; ++trial) {
            const V p = random.vector(10) + V{0, 0, 80};
            Row<double> rows[3], ahead[3], behind[3];
            sighting_rows(p, sighting, rows);
            for (int axis = 0; axis < 3; ++axis) {
                constexpr double kStep = 1e-5;
                V delta{axis == 0 ? kStep : 0, axis == 1 ? kStep : 0, axis == 2 ? kStep : 0};
                sighting_rows(p + delta, sighting, ahead);
                sighting_rows(p - delta, sighting, behind);
                for (int r = 0; r < 3; ++r)
                    CHECK(component(rows[r].gradient, axis) ==
                          doctest::Approx((ahead[r].value - behind[r].value) / (2 * kStep))
                              .epsilon(1e-7)
                              .scale(1));
            }
        }
}

TEST_CASE(
    "a patch's residual is what its information says, in mm at its depth, and never more than a "
    "sure patch's") {
    const defrec_camera camera{500, 500, 240, 130, 4.6, 0};
    defrec_patch_observation seen{};
    seen.u = 240 * 256;
    seen.v = 130 * 256;
    seen.valid = 1;
    Sighting<double> sighting{};
    CHECK_FALSE(patch_sighting(camera, seen, sighting));  // no information
    for (const double size : {0.25, 1.0, 50.0}) {
        seen.information[0] = float(size);
        seen.information[2] = float(size / 4);
        REQUIRE(patch_sighting(camera, seen, sighting));
        Row<double> rows[3];
        sighting_rows(V{0.3, 0.2, 80}, sighting, rows);
        const double squared = rows[0].value * rows[0].value + rows[1].value * rows[1].value;
        CHECK(rows[2].value == 0);
        CHECK(squared == doctest::Approx(std::min(size, 1.0) * (0.3 * 0.3 + 0.25 * 0.2 * 0.2)));
    }
    seen.information[1] = std::numeric_limits<float>::quiet_NaN();
    CHECK_FALSE(patch_sighting(camera, seen, sighting));
}

TEST_CASE("information whose square single precision does not hold is scaled down as any other") {
    const defrec_camera camera{500, 500, 240, 130, 4.6, 0};
    for (const auto& [a, b, c] : {std::array{1e30f, 0.0f, 1.0f}, std::array{1e19f, 1e19f, 3e19f},
                                  std::array{3e38f, -2e38f, 3e38f}, std::array{0.0f, 0.0f, 3e38f},
                                  std::array{4e-30f, 1e-30f, 2e-30f}}) {
        const defrec_patch_observation seen{0, 0, 0, 1, {a, b, c}, 0};
        Sighting<double> expected{};
        Sighting<float> actual{};
        REQUIRE(patch_sighting(camera, seen, expected));
        REQUIRE(patch_sighting(camera, seen, actual));
        CHECK(actual.uu == doctest::Approx(expected.uu));
        CHECK(actual.uv == doctest::Approx(expected.uv));
        CHECK(std::abs(double(actual.vv) - expected.vv) < 1e-3);
    }
}

TEST_CASE(
    "the ICP residual is the distance along the normal, and its gradient moves it for a flat live "
    "surface") {
    const defrec_camera camera{500, 500, 120, 80, 4.6, 0};
    const std::vector<int16_t> flat(240 * 160, int16_t(16 * 500 * 4.6 / 80));
    const double depth = 16 * 500 * 4.6 / flat[0];
    const DisparityImage image{flat.data(), 240, 160, 240};
    const V normal{0, 0, -1}, p{2, 1, 78};
    Row<double> row{};
    REQUIRE(icp_row(camera, image, 10.0, p, normal, row));
    CHECK(row.value == doctest::Approx(-(depth - 78)));
    Row<double> ahead{};
    REQUIRE(icp_row(camera, image, 10.0, p + V{0.1, -0.2, 0.3}, normal, ahead));
    CHECK(ahead.value - row.value == doctest::Approx(dot(row.gradient, V{0.1, -0.2, 0.3})));

    CHECK_FALSE(icp_row(camera, image, 1.0, p, normal, row));               // too far
    CHECK_FALSE(icp_row(camera, image, 10.0, p, V{0, 0, 1}, row));          // facing away
    CHECK_FALSE(icp_row(camera, image, 10.0, p, V{1, 0, 0}, row));          // seen edge on
    CHECK_FALSE(icp_row(camera, image, 10.0, V{60, 0, 78}, normal, row));   // outside
    CHECK_FALSE(icp_row(camera, image, 200.0, V{0, 0, -78}, normal, row));  // behind
    CHECK_FALSE(icp_row(camera, DisparityImage{nullptr, 240, 160, 240}, 10.0, p, normal, row));
}

TEST_CASE("ARAP: gradient and blocks are those of its residuals by finite differences") {
    Random random;
    for (int trial = 0; trial < 10; ++trial) {
        NodePose<double> a = random.pose(), b = random.pose();
        if (trial % 2) b.rotation = -1.0 * b.rotation;
        const V rest = random.vector(5);
        const double length = std::sqrt(dot(rest, rest));
        const V direction = (1 / length) * rest;
        const ArapWeights<double> weights{1.3, 0.7, 2.1};

        // All residuals of both directions, with the roots of their weights.
        const auto residuals = [&](const NodePose<double>& pa, const NodePose<double>& pb) {
            const auto g = arap_geometry(pa, pb, direction, length);
            const V ab = g.turned_a - g.now, ba = g.turned_b + g.now;
            const auto q = pa.rotation - g.qb;
            const double l = std::sqrt(2 * weights.length), n = std::sqrt(weights.angle),
                         r = std::sqrt(2 * weights.rotation);
            return std::vector<double>{l * g.stretch, n * ab.x, n * ab.y, n * ab.z,
                                       n * ba.x,      n * ba.y, n * ba.z, r * q.w,
                                       r * q.x,       r * q.y,  r * q.z};
        };
        const auto at = residuals(a, b);
        std::vector<std::vector<double>> jacobian;
        constexpr double kStep = 1e-5;
        for (int i = 0; i < 12; ++i) {
            const auto side = [&](double size) {
                return residuals(i < 6 ? nudged(a, i, size) : a,
                                 i < 6 ? b : nudged(b, i - 6, size));
            };
            const auto ahead = side(kStep), behind = side(-kStep);
            auto& column = jacobian.emplace_back();
            for (size_t r = 0; r < at.size(); ++r)
                column.push_back((ahead[r] - behind[r]) / (2 * kStep));
        }
        const auto product = [](const std::vector<double>& x, const std::vector<double>& y) {
            double sum = 0;
            for (size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
            return sum;
        };

        const auto term = arap_term(arap_geometry(a, b, direction, length), a.rotation, weights);
        CHECK(term.cost == doctest::Approx(product(at, at)));
        const auto close = [](double expected) {
            return doctest::Approx(expected).epsilon(1e-6).scale(1);
        };
        for (size_t i = 0; i < 6; ++i) {
            CHECK(term.gradient_a[i] == close(product(jacobian[i], at)));
            CHECK(term.gradient_b[i] == close(product(jacobian[6 + i], at)));
            for (size_t j = 0; j < 6; ++j) {
                CHECK(term.aa[6 * i + j] == close(product(jacobian[i], jacobian[j])));
                CHECK(term.bb[6 * i + j] == close(product(jacobian[6 + i], jacobian[6 + j])));
                CHECK(term.ab[6 * i + j] == close(product(jacobian[i], jacobian[6 + j])));
            }
        }
    }
}

TEST_CASE("ARAP costs nothing under a rigid motion, and something under any other") {
    Random random;
    const V pa{1, 2, 80}, pb{5, 1, 78};
    const V along = pb - pa;
    const double length = std::sqrt(dot(along, along));
    const V direction = (1 / length) * along;
    const ArapWeights<double> weights{1, 1, 1};
    const auto cost = [&](const NodePose<double>& a, const NodePose<double>& b) {
        return arap_cost(arap_geometry(a, b, direction, length), a.rotation, weights);
    };
    for (int trial = 0; trial < 10; ++trial) {
        const auto motion = from_rigid(rotation_from_vector(random.vector(2)), random.vector(30));
        const NodePose<double> a{motion.real, apply(motion, pa)},
            b{-1.0 * motion.real, apply(motion, pb)};
        CHECK(cost(a, b) < 1e-20);
        for (int i = 0; i < 6; ++i) {
            CHECK(cost(nudged(a, i, 0.1), b) > 1e-4);
            CHECK(cost(a, nudged(b, i, 0.1)) > 1e-4);
        }
    }
    // acos would have an infinite slope here; the difference of unit vectors has none.
    const NodePose<double> coincident{{1, 0, 0, 0}, pa};
    const auto term = arap_term(arap_geometry(coincident, coincident, direction, length),
                                coincident.rotation, weights);
    CHECK(std::isfinite(term.cost));
    for (const double value : term.ab) CHECK(std::isfinite(value));
}
