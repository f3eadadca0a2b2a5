// Tests of backends/shared/motion.hpp.
#include "backends/shared/motion.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <limits>

using namespace defrec;

namespace {
struct Rigid {
    double rotation[9], t[3];
};
Rigid rigid(double angle, Eigen::Vector3d axis, Eigen::Vector3d t) {
    Rigid out{};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out.rotation) =
        Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    Eigen::Map<Eigen::Vector3d>(out.t) = t;
    return out;
}
Vec3<double> matrix_apply(const Rigid& r, Vec3<double> p) {
    const double* m = r.rotation;
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + r.t[0],
            m[3] * p.x + m[4] * p.y + m[5] * p.z + r.t[1],
            m[6] * p.x + m[7] * p.y + m[8] * p.z + r.t[2]};
}
double distance(Vec3<double> a, Vec3<double> b) { return std::sqrt(dot(a - b, a - b)); }
}  // namespace

TEST_CASE("a dual quaternion moves points as its matrix does, for every branch of the conversion") {
    const Vec3<double> p{3, -2, 70};
    for (const double angle : {0.0, 1e-9, 0.3, 2.0, 3.14159265358979, 4.0})
        for (const Eigen::Vector3d& axis :
             {Eigen::Vector3d(1, 0.1, 0), Eigen::Vector3d(0, 1, 0.1), Eigen::Vector3d(0.1, 0, 1)}) {
            const Rigid r = rigid(angle, axis, {1, 2, -30});
            const auto m = from_rigid(r.rotation, r.t);
            CHECK(distance(apply(m, p), matrix_apply(r, p)) < 1e-12 * 100);
            CHECK(distance(apply(inverse(m), apply(m, p)), p) < 1e-12 * 100);
            Rigid back{};
            to_rigid(m, back.rotation, back.t);
            for (int i = 0; i < 9; ++i)
                CHECK(back.rotation[i] == doctest::Approx(r.rotation[i]).epsilon(1e-12));
        }
}

TEST_CASE("compose applies its second argument first") {
    const Rigid a = rigid(0.4, {1, 2, 3}, {5, 0, 1}), b = rigid(-1.1, {0, 2, 1}, {0, -4, 2});
    const Vec3<double> p{1, 2, 3};
    const auto both = compose(from_rigid(a.rotation, a.t), from_rigid(b.rotation, b.t));
    CHECK(distance(apply(both, p), matrix_apply(a, matrix_apply(b, p))) < 1e-12);
}

TEST_CASE("a rotation vector rotates about itself by its length") {
    const auto q = rotation_from_vector(Vec3<double>{0, 0, 0.5});
    const auto v = rotate(q, Vec3<double>{1, 0, 0});
    CHECK(v.x == doctest::Approx(std::cos(0.5)));
    CHECK(v.y == doctest::Approx(std::sin(0.5)));
}

TEST_CASE("normalise makes a dual quaternion unit and leaves its motion") {
    const Rigid r = rigid(0.7, {1, 1, 0}, {9, 8, 7});
    const auto unit = from_rigid(r.rotation, r.t);
    const DualQuaternion<double> scaled{3.0 * unit.real, 3.0 * unit.dual + 0.25 * unit.real};
    const auto again = normalise(scaled);
    CHECK(dot(again.real, again.real) == doctest::Approx(1));
    CHECK(std::abs(dot(again.real, again.dual)) < 1e-12);
    CHECK(distance(apply(again, {1, 2, 3}), apply(unit, {1, 2, 3})) < 1e-12);
    CHECK(normalise(DualQuaternion<double>{}).real.w == 1.0);
}

TEST_CASE("normalise does so for every length that single precision holds") {
    const Rigid r = rigid(0.7, {1, 1, 0}, {9, 8, 7});
    const auto unit = from_rigid(r.rotation, r.t);
    const auto single = DualQuaternion<float>::load(unit.store());
    const auto plain = normalise(single);
    for (const float length :
         {0x1p-120f, 0x1p-64f, 0x1p-63f, 0x1p-20f, 8.0f, 0x1p62f, 0x1p63f, 0x1p64f, 0x1p120f}) {
        CAPTURE(length);
        const auto scaled =
            normalise(DualQuaternion<float>{length * single.real, length * single.dual});
        CHECK(std::abs(dot(scaled.real, plain.real) - 1) < 1e-6f);
        const Vec3<float> t = translation(scaled);
        CHECK(distance({double(t.x), double(t.y), double(t.z)}, {9, 8, 7}) < 1e-4);
    }
    for (const float length : {0.0f, 1e-39f, std::numeric_limits<float>::infinity()})
        CHECK(normalise(DualQuaternion<float>{{length, 0, 0, 0}, {0, 1, 0, 0}}).dual.x == 0);
}

TEST_CASE("blending equal motions gives that motion, whatever the signs of the quaternions") {
    const Rigid r = rigid(1.5, {1, -1, 0.5}, {4, 5, 6});
    const auto m = from_rigid(r.rotation, r.t);
    const DualQuaternion<double> motions[2] = {m, {-1.0 * m.real, -1.0 * m.dual}};
    const int32_t node[4] = {0, 1, 1, 0};
    const float weight[4] = {0.5f, 0.25f, 0.25f, 0.0f};
    CHECK(distance(apply(blend(motions, node, weight), {1, 2, 3}), matrix_apply(r, {1, 2, 3})) <
          1e-12);
}

TEST_CASE(
    "blending two translations averages them, and blending half a rotation with none gives its "
    "middle") {
    const Rigid a = rigid(0, {1, 0, 0}, {2, 0, 0}), b = rigid(0, {1, 0, 0}, {0, 4, 0}),
                c = rigid(1.0, {0, 0, 1}, {0, 0, 0});
    const DualQuaternion<double> motions[3] = {
        from_rigid(a.rotation, a.t), from_rigid(b.rotation, b.t), from_rigid(c.rotation, c.t)};
    const float weight[4] = {0.5f, 0.5f, 0.0f, 0.0f};
    const int32_t shifts[4] = {0, 1, 0, 0};
    CHECK(distance(apply(blend(motions, shifts, weight), {0, 0, 0}), {1, 2, 0}) < 1e-12);
    const DualQuaternion<double> turns[2] = {DualQuaternion<double>::identity(), motions[2]};
    const auto v = apply(blend(turns, shifts, weight), {1, 0, 0});
    CHECK(std::atan2(v.y, v.x) == doctest::Approx(0.5));
}

TEST_CASE("motions survive the float record") {
    const Rigid r = rigid(0.9, {1, 2, 2}, {10, -20, 80});
    const auto m = from_rigid(r.rotation, r.t);
    CHECK(distance(apply(DualQuaternion<double>::load(m.store()), {10, 10, 80}),
                   matrix_apply(r, {10, 10, 80})) < 1e-4);
}
