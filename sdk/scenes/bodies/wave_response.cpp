// How an elastic half-space or layer answers to loads that are waves.
#include "sdk/scenes/bodies/wave_response.hpp"

#include <Eigen/LU>
#include <cmath>

namespace defrec::cli {
namespace {

/// The potentials psi = A e + B g and phi = C e + D g with e = exp(-kz) and g = exp(k (z - h)) give
///   down = (3 - 4n) psi - z psi' - phi',          along = k (z psi + phi),
///   stress zz = 2 (1 - n) psi' - k^2 (z psi + phi),
///   stress xz = k (-(1 - 2n) psi + z psi' + phi').
/// Each row below is one of these for (A, B, C, D).
struct Rows {
    Eigen::RowVector4d down, along, stress_zz, stress_xz;
};

Rows rows_at(const Layer& layer, double k, double z) {
    const double n = layer.poisson;
    const double e = std::exp(-k * z);
    const double g = layer.thickness > 0 ? std::exp(k * (z - layer.thickness)) : 0.0;
    const Eigen::RowVector4d psi(e, g, 0, 0), psi_slope(-k * e, k * g, 0, 0);
    const Eigen::RowVector4d phi(0, 0, e, g), phi_slope(0, 0, -k * e, k * g);
    return {(3 - 4 * n) * psi - z * psi_slope - phi_slope, k * (z * psi + phi),
            2 * (1 - n) * psi_slope - k * k * (z * psi + phi),
            k * (-(1 - 2 * n) * psi + z * psi_slope + phi_slope)};
}

}  // namespace

WaveResponse::WaveResponse(const Layer& layer, double wave_number)
    : layer_(layer), k_(wave_number) {
    const Rows top = rows_at(layer, k_, 0);
    Eigen::Matrix4d conditions;
    conditions.row(0) = top.stress_zz;
    conditions.row(1) = top.stress_xz;
    if (layer.thickness > 0) {
        const Rows base = rows_at(layer, k_, layer.thickness);
        conditions.row(2) = base.down;
        conditions.row(3) = base.along;
    } else {
        // Nothing grows with depth.
        conditions.row(2) = Eigen::RowVector4d(0, 1, 0, 0);
        conditions.row(3) = Eigen::RowVector4d(0, 0, 0, 1);
    }
    const Eigen::FullPivLU<Eigen::Matrix4d> solver(conditions);
    pressed_ = solver.solve(Eigen::Vector4d(-1, 0, 0, 0));
    dragged_ = solver.solve(Eigen::Vector4d(0, -1, 0, 0));
}

WaveAmplitudes WaveResponse::amplitudes(const Eigen::Vector4d& potentials, double z) const {
    const Rows rows = rows_at(layer_, k_, z);
    return {rows.along * potentials, rows.down * potentials};
}

double WaveResponse::to_traction_across(double z) const {
    const double free = 2 / k_ * std::exp(-k_ * z);
    if (layer_.thickness == 0) {
        return free;
    }
    const double h = layer_.thickness;
    return (free - 2 / k_ * std::exp(-k_ * (2 * h - z))) / (1 + std::exp(-2 * k_ * h));
}

}  // namespace defrec::cli
