// See force_modes.hpp. Finite elements of linear elasticity on a lattice (Hughes, The Finite
// Element Method, 1987; for deformable models Sifakis and Barbic, FEM Simulation of 3D Deformable
// Solids, SIGGRAPH courses 2012). Responses to forces on the surface, computed before the surface
// that is seen is looked at and superposed, as Heiselman, Jarnagin and Miga do (Intraoperative
// Correction of Liver Deformation Using Sparse Surface and Vascular Features via Linearized
// Iterative Boundary Reconstruction, IEEE Trans. Med. Imaging 39, 2020). Forces of a free body are
// balanced by its inertia.
#include "sdk/registration/elastic/force_modes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/body/closed_mesh.hpp"
#include "sdk/body/stiffness.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/pose.hpp"

namespace defrec {
namespace {

using decisions::ElasticModel;

constexpr const char* kName = "the model";

ClosedMesh closed_mesh(const ModelSurface& surface) {
    const std::vector<uint32_t> merged = surface.merged_vertices();
    std::vector<uint32_t> triangles;
    for (const uint32_t vertex : surface.triangles()) triangles.push_back(merged[vertex]);
    return ClosedMesh({surface.vertices().data(), surface.vertices().size() / 3, triangles.data(),
                       triangles.size() / 3},
                      kName);
}

// Cubes of one size that the mesh fills.
Lattice lattice_of(const ClosedMesh& mesh, double volume_mm3) {
    Lattice::Request request;
    request.step = std::cbrt(volume_mm3 / ElasticModel::kCells);
    request.low = mesh.low() - Eigen::Vector3d::Constant(request.step / 2);
    request.high = mesh.high() + Eigen::Vector3d::Constant(request.step / 2);
    request.stiffness = [&](const Eigen::Vector3d& centre, double edge) {
        const double share = mesh.inside_share(centre, edge);
        return share < ElasticModel::kMinShare ? 0 : std::max(share, ElasticModel::kMinStiffness);
    };
    request.distance = [](const Eigen::Vector3d&) { return 0.0; };
    request.max_cells = ElasticModel::kMaxCells;
    try {
        return Lattice(request);
    } catch (const Error& error) {
        fail(DEFREC_ERROR_ARGUMENT, kName, " is too thin to be deformed: ", error.what());
    }
}

void expect_one_body(const Lattice& lattice) {
    std::vector<size_t> parent(lattice.nodes().size());
    std::iota(parent.begin(), parent.end(), size_t{0});
    const auto root = [&](size_t node) {
        while (parent[node] != node) node = parent[node] = parent[parent[node]];
        return node;
    };
    for (const Lattice::Cell& cell : lattice.cells())
        for (size_t corner = 1; corner < 8; ++corner)
            parent[root(node_of(cell, corner))] = root(node_of(cell, 0));
    size_t bodies = 0;
    for (size_t node = 0; node < parent.size(); ++node) bodies += parent[node] == node;
    if (bodies != 1)
        fail(DEFREC_ERROR_ARGUMENT, kName, " consists of ", bodies,
             " bodies that do not touch, expected one that is deformed");
}

// The area of the surface that counts for each node, mm^2. Triangles larger than a cell count by
// the middles of equal parts of them.
std::vector<double> surface_areas(const Lattice& lattice, const ModelSurface& surface) {
    std::vector<double> areas(lattice.nodes().size(), 0);
    const auto add = [&](const Eigen::Vector3d& place, double area) {
        const Lattice::Place at = lattice.find_near(place, ElasticModel::kReach);
        if (at.cell < 0) return;
        const auto weights = at.weights();
        const Lattice::Cell& cell = lattice.cells()[static_cast<size_t>(at.cell)];
        for (size_t corner = 0; corner < 8; ++corner)
            areas[node_of(cell, corner)] += weights[corner] * area;
    };
    const auto vertex = [&](size_t corner) -> Eigen::Vector3d {
        return Eigen::Map<const Eigen::Vector3f>(
                   &surface.vertices()[3 * size_t{surface.triangles()[corner]}])
            .cast<double>();
    };
    for (size_t i = 0; i < surface.triangles().size(); i += 3) {
        const Eigen::Vector3d a = vertex(i), u = vertex(i + 1) - a, v = vertex(i + 2) - a;
        const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
        const int parts = static_cast<int>(std::ceil(longest / lattice.step()));
        const double area = u.cross(v).norm() / (2 * parts * parts);
        for (int row = 0; row < parts; ++row)
            for (int k = 0; k < 2 * (parts - row) - 1; ++k) {
                const int column = k / 2;
                const double third = (k % 2 == 0 ? 1 : 2) / 3.0;
                add(a + ((column + third) * u + (row + third) * v) / parts, area);
            }
    }
    return areas;
}

// The parts of the equations of a body's motion.
struct BodyMatrices {
    std::vector<double> area, volume;                  // of each node, mm^2, mm^3
    Eigen::Matrix<double, Eigen::Dynamic, 6> rigid;    // displacements by a twist
    Eigen::Matrix<double, Eigen::Dynamic, 6> inertia;  // forces by such an acceleration
    Eigen::Matrix<double, 6, 6> inverse_inertia;

    BodyMatrices(const Lattice& lattice, const ModelSurface& surface)
        : area(surface_areas(lattice, surface)), volume(area.size(), 0) {
        for (const Lattice::Cell& cell : lattice.cells())
            for (size_t corner = 0; corner < 8; ++corner)
                volume[node_of(cell, corner)] +=
                    static_cast<double>(cell.stiffness) * std::pow(lattice.edge(cell), 3) / 8;
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        double sum = 0;
        for (size_t i = 0; i < volume.size(); ++i) {
            centre += volume[i] * lattice.nodes()[i];
            sum += volume[i];
        }
        centre /= sum;
        const auto rows = static_cast<Eigen::Index>(3 * volume.size());
        rigid.resize(rows, 6);
        inertia.resize(rows, 6);
        for (size_t i = 0; i < volume.size(); ++i) {
            const auto row = static_cast<Eigen::Index>(3 * i);
            rigid.middleRows<3>(row) = place_shift(lattice.nodes()[i] - centre);
            inertia.middleRows<3>(row) = volume[i] * rigid.middleRows<3>(row);
        }
        inverse_inertia = (rigid.transpose() * inertia).inverse();
    }
    // Takes away the share that would accelerate the body.
    void balance(Eigen::MatrixXd& forces) const {
        forces -= inertia * (inverse_inertia * (rigid.transpose() * forces));
    }
    // Takes away the motion of the body as a whole.
    void hold(Eigen::MatrixXd& shifts) const {
        shifts -= rigid * (inverse_inertia * (inertia.transpose() * shifts));
    }
};

// Nodes of the surface that are spread over it, so far apart.
std::vector<size_t> spread_nodes(const Lattice& lattice, const std::vector<double>& area,
                                 double apart) {
    std::vector<double> squared(area.size(), std::numeric_limits<double>::infinity());
    size_t next = 0;
    while (area[next] == 0) ++next;
    std::vector<size_t> found;
    for (double farthest = std::numeric_limits<double>::infinity(); farthest >= apart * apart;) {
        found.push_back(next);
        farthest = 0;
        const size_t last = next;
        for (size_t i = 0; i < area.size(); ++i) {
            if (area[i] == 0) continue;
            squared[i] =
                std::min(squared[i], (lattice.nodes()[i] - lattice.nodes()[last]).squaredNorm());
            if (squared[i] <= farthest) continue;
            farthest = squared[i];
            next = i;
        }
    }
    return found;
}

// Forces along each axis about spread places, a column each, balanced.
Eigen::MatrixXd smooth_forces(const Lattice& lattice, const BodyMatrices& body, double width) {
    const std::vector<size_t> centres =
        spread_nodes(lattice, body.area, ElasticModel::kForceSpacing * width);
    Eigen::MatrixXd forces =
        Eigen::MatrixXd::Zero(body.rigid.rows(), static_cast<Eigen::Index>(3 * centres.size()));
    for (size_t c = 0; c < centres.size(); ++c)
        for (size_t i = 0; i < body.area.size(); ++i) {
            const double squared = (lattice.nodes()[i] - lattice.nodes()[centres[c]]).squaredNorm();
            const double force = body.area[i] * std::exp(-squared / (2 * width * width));
            for (Eigen::Index axis = 0; axis < 3; ++axis)
                forces(static_cast<Eigen::Index>(3 * i) + axis,
                       static_cast<Eigen::Index>(3 * c) + axis) = force;
        }
    body.balance(forces);
    return forces;
}

StiffnessFactor factor_of(const Lattice& lattice, const BodyMatrices& body) {
    StiffnessSum sum(lattice.free_nodes());
    sum.add_cells(lattice, ElasticModel::kPoissonRatio);
    for (size_t node = 0; node < body.area.size(); ++node) {
        const double spring =
            (body.area[node] + lattice.step() * lattice.step()) / ElasticModel::kSpringLength;
        const auto index = static_cast<int32_t>(node);
        sum.add(index, index, spring * Eigen::Matrix3d::Identity());
    }
    return StiffnessFactor(sum.matrix());
}

// Displacements that the forces cause, without motions of the whole.
Eigen::MatrixXd responses(const StiffnessFactor& factor, const BodyMatrices& body,
                          const Eigen::MatrixXd& forces, const Services* helpers) {
    constexpr Eigen::Index kWidth = StiffnessFactor::RightSides::ColsAtCompileTime;
    Eigen::MatrixXd shifts(forces.rows(), forces.cols());
    const Eigen::Index runs = (forces.cols() + kWidth - 1) / kWidth;
    helped_loop(helpers, static_cast<size_t>(runs), [&](size_t run) {
        const Eigen::Index first = static_cast<Eigen::Index>(run) * kWidth,
                           count = std::min(kWidth, forces.cols() - first);
        StiffnessFactor::RightSides x = StiffnessFactor::RightSides::Zero(forces.rows(), kWidth);
        for (Eigen::Index i = 0; i < forces.rows(); ++i)
            for (Eigen::Index k = 0; k < count; ++k)
                x(factor.order()[i], k) = static_cast<float>(forces(i, first + k));
        factor.solve(x);
        for (Eigen::Index i = 0; i < forces.rows(); ++i)
            for (Eigen::Index k = 0; k < count; ++k)
                shifts(i, first + k) = static_cast<double>(x(factor.order()[i], k));
    });
    body.hold(shifts);
    return shifts;
}

// Combinations of the responses that are orthogonal over the surface, the largest first, then such
// that they are orthogonal in energy as well, the softest first.
Eigen::MatrixXd orthogonal(const Eigen::MatrixXd& shifts, const Eigen::MatrixXd& forces,
                           const std::vector<double>& area, Eigen::VectorXd& stiffness) {
    const double whole = std::accumulate(area.begin(), area.end(), 0.0);
    Eigen::VectorXd weight(shifts.rows());
    for (Eigen::Index i = 0; i < weight.size(); ++i)
        weight[i] = std::sqrt(area[static_cast<size_t>(i / 3)] / whole);
    const Eigen::MatrixXd weighted = weight.asDiagonal() * shifts;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> sizes(weighted.transpose() * weighted);
    const Eigen::VectorXd& power = sizes.eigenvalues();  // they rise
    const double least = ElasticModel::kMinPower * power.tail<1>().value();
    Eigen::Index kept = 0;
    while (kept < std::min<Eigen::Index>(ElasticModel::kMaxModes, power.size()) &&
           power[power.size() - 1 - kept] > least)
        ++kept;
    const Eigen::MatrixXd unit = sizes.eigenvectors().rightCols(kept) *
                                 power.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
    const Eigen::MatrixXd energy = unit.transpose() * (shifts.transpose() * (forces * unit));
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes((energy + energy.transpose()) / 2);
    stiffness = modes.eigenvalues();
    return shifts * (unit * modes.eigenvectors());
}

}  // namespace

ForceModes::ForceModes(const ModelSurface& surface, const Services* helpers) {
    const ClosedMesh mesh = closed_mesh(surface);
    lattice_ = std::make_unique<const Lattice>(lattice_of(mesh, surface.findings().volume_mm3));
    expect_one_body(*lattice_);
    const BodyMatrices body(*lattice_, surface);
    const Eigen::MatrixXd forces = smooth_forces(
        *lattice_, body, ElasticModel::kForceWidth * std::sqrt(surface.findings().area_mm2));
    const Eigen::MatrixXd shifts = responses(factor_of(*lattice_, body), body, forces, helpers);
    nodes_ = orthogonal(shifts, forces, body.area, stiffness_);
}

Lattice::Place ForceModes::find(const Eigen::Vector3d& place) const {
    return lattice_->find_near(place, ElasticModel::kReach);
}

ForceModes::Shifts ForceModes::at(const Eigen::Vector3d& place) const {
    const Lattice::Place found = find(place);
    Shifts made = Shifts::Zero(3, count());
    if (found.cell < 0) return made;
    const Lattice::Cell& cell = lattice_->cells()[static_cast<size_t>(found.cell)];
    const auto weights = found.weights();
    for (size_t k = 0; k < 8; ++k) made += weights[k] * nodes_.middleRows<3>(3 * cell.node[k]);
    return made;
}

Eigen::VectorXd ForceModes::node_shifts(const Eigen::VectorXd& coefficients) const {
    return nodes_ * coefficients;
}

Eigen::Vector3d ForceModes::shift(const Lattice::Place& at,
                                  const Eigen::VectorXd& node_shifts) const {
    if (at.cell < 0) return Eigen::Vector3d::Zero();
    const Lattice::Cell& cell = lattice_->cells()[static_cast<size_t>(at.cell)];
    const auto weights = at.weights();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < 8; ++k) sum += weights[k] * node_shifts.segment<3>(3 * cell.node[k]);
    return sum;
}

// From the means of opposite faces.
Eigen::Matrix3d ForceModes::strain(const Lattice::Cell& cell,
                                   const Eigen::VectorXd& node_shifts) const {
    Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();
    for (size_t k = 0; k < 8; ++k)
        for (int axis = 0; axis < 3; ++axis)
            slope.col(axis) += ((k >> axis & 1) != 0 ? 1 : -1) *
                               node_shifts.segment<3>(3 * cell.node[k]) /
                               (4 * lattice_->edge(cell));
    return (slope + slope.transpose()) / 2;
}

double ForceModes::largest_strain(const Eigen::VectorXd& node_shifts) const {
    double largest = 0;
    for (const Lattice::Cell& cell : lattice_->cells())
        largest = std::max(largest, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
                                        strain(cell, node_shifts), Eigen::EigenvaluesOnly)
                                        .eigenvalues()
                                        .cwiseAbs()
                                        .maxCoeff());
    return largest;
}

double ForceModes::rms_strain(const Eigen::VectorXd& node_shifts) const {
    double squared = 0;
    for (const Lattice::Cell& cell : lattice_->cells())
        squared += strain(cell, node_shifts).squaredNorm();
    return std::sqrt(squared / static_cast<double>(lattice_->cells().size()));
}

}  // namespace defrec
