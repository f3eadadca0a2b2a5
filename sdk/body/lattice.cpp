// See lattice.hpp.
#include "sdk/body/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sdk/base/util/error.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

using decisions::BodyCells;

constexpr int32_t kLargest = BodyCells::kLargest;

}  // namespace

std::array<double, 8> Lattice::Place::weights() const {
    std::array<double, 8> weights{};
    for (size_t corner = 0; corner < 8; ++corner)
        weights[corner] = (corner & 1 ? at.x() : 1 - at.x()) * (corner & 2 ? at.y() : 1 - at.y()) *
                          (corner & 4 ? at.z() : 1 - at.z());
    return weights;
}

uint64_t Lattice::key(const Corner& corner, int32_t size) {
    constexpr uint64_t kBits = 20;
    uint64_t value = static_cast<uint64_t>(size);
    for (const int32_t c : corner) value = value << kBits | static_cast<uint64_t>(c);
    return value;
}

Lattice::Lattice(const Request& request) : step_(request.step), low_(request.low) {
    for (int axis = 0; axis < 3; ++axis) {
        const double cells = (request.high[axis] - request.low[axis]) / (kLargest * step_);
        count_[static_cast<size_t>(axis)] =
            kLargest * static_cast<int32_t>(std::clamp(std::ceil(cells), 1.0, 1e5));
    }
    if (static_cast<double>(count_[0]) * count_[1] * count_[2] >
        BodyCells::kMaxCubes * kLargest * kLargest * kLargest)
        fail(DEFREC_ERROR_UNSUPPORTED, "the body is too large for cells of ", step_, " mm");
    bool is_wanted = true;
    for (int32_t z = 0; z < count_[2]; z += kLargest)
        for (int32_t y = 0; y < count_[1]; y += kLargest)
            for (int32_t x = 0; x < count_[0]; x += kLargest) {
                block_begin_.push_back(cells_.size());
                is_wanted = is_wanted && (!request.is_wanted || request.is_wanted());
                if (!is_wanted) continue;
                divide(request, {x, y, z}, kLargest);
            }
    block_begin_.push_back(cells_.size());
    for (size_t i = 0; i < cells_.size(); ++i)
        cell_of_.emplace(key(cells_[i].corner, cells_[i].size), static_cast<int32_t>(i));
    number_nodes();
}

void Lattice::divide(const Request& request, const Corner& corner, int32_t size) {
    const double edge = size * step_;
    const Eigen::Vector3d centre =
        low_ + step_ * Eigen::Vector3d(corner[0] + 0.5 * size, corner[1] + 0.5 * size,
                                       corner[2] + 0.5 * size);
    if (size == 1 || request.distance(centre) > (BodyCells::kCoarseDistance + 0.5) * edge) {
        const double stiffness = request.stiffness(centre, edge);
        if (!(stiffness > 0)) return;
        if (cells_.size() >= request.max_cells)
            fail(DEFREC_ERROR_UNSUPPORTED, "the body needs more than ", request.max_cells,
                 " cells of ", step_, " mm and more");
        cells_.push_back({corner, size, static_cast<float>(stiffness), {}});
        return;
    }
    const int32_t half = size / 2;
    for (int32_t part = 0; part < 8; ++part)
        divide(request,
               {corner[0] + (part & 1) * half, corner[1] + (part >> 1 & 1) * half,
                corner[2] + (part >> 2) * half},
               half);
}

int32_t Lattice::cell_at(const Corner& fine) const {
    for (size_t axis = 0; axis < 3; ++axis)
        if (fine[axis] < 0 || fine[axis] >= count_[axis]) return -1;
    for (int32_t size = 1; size <= kLargest; size *= 2) {
        const Corner corner{fine[0] / size * size, fine[1] / size * size, fine[2] / size * size};
        if (const auto found = cell_of_.find(key(corner, size)); found != cell_of_.end())
            return found->second;
    }
    return -1;
}

// The corners of a lattice's cells, those that do not hang first.
class Lattice::Corners {
  public:
    explicit Corners(const Lattice& lattice) : lattice_(lattice) {
        for (const Cell& cell : lattice.cells_)
            for (size_t k = 0; k < 8; ++k) {
                const Corner at = corner_of(cell, k);
                if (known_.emplace(key(at, 0), all_.size()).second)
                    all_.push_back({at, host_of(at)});
            }
        for (const bool hangs : {false, true}) {
            for (size_t i = 0; i < all_.size(); ++i)
                if ((all_[i].host >= 0) == hangs) {
                    all_[i].node = static_cast<int32_t>(order_.size());
                    order_.push_back(i);
                }
            if (!hangs) free_ = order_.size();
        }
    }

    size_t size() const { return order_.size(); }
    size_t free() const { return free_; }
    const Corner& at(size_t node) const { return all_[order_[node]].at; }
    int32_t node(const Cell& cell, size_t k) const { return find(cell, k).node; }
    // The free nodes that a node's value is made of, with their weights.
    std::map<int32_t, double> terms(size_t node) const {
        std::map<int32_t, double> sum;
        add_terms(all_[order_[node]], 1, sum);
        return sum;
    }

  private:
    struct Entry {
        Corner at;
        int32_t host = -1;  // the largest cell that it hangs on
        int32_t node = -1;
    };

    static Corner corner_of(const Cell& cell, size_t k) {
        return {cell.corner[0] + static_cast<int32_t>(k & 1) * cell.size,
                cell.corner[1] + static_cast<int32_t>(k >> 1 & 1) * cell.size,
                cell.corner[2] + static_cast<int32_t>(k >> 2) * cell.size};
    }
    const Entry& find(const Cell& cell, size_t k) const {
        return all_[known_.at(key(corner_of(cell, k), 0))];
    }
    int32_t host_of(const Corner& at) const {
        int32_t host = -1;
        for (int32_t octant = 0; octant < 8; ++octant) {
            const int32_t found = lattice_.cell_at(
                {at[0] - (octant & 1), at[1] - (octant >> 1 & 1), at[2] - (octant >> 2)});
            if (found < 0) continue;
            const Cell& cell = lattice_.cells_[static_cast<size_t>(found)];
            bool is_corner = true;
            for (size_t axis = 0; axis < 3; ++axis)
                is_corner &= (at[axis] - cell.corner[axis]) % cell.size == 0;
            if (!is_corner &&
                (host < 0 || lattice_.cells_[static_cast<size_t>(host)].size < cell.size))
                host = found;
        }
        return host;
    }
    // The corners of an entry's host are free, or hang on a larger cell.
    void add_terms(const Entry& entry, double weight, std::map<int32_t, double>& sum) const {
        if (entry.host < 0) {
            sum[entry.node] += weight;
            return;
        }
        const Cell& cell = lattice_.cells_[static_cast<size_t>(entry.host)];
        Place place;
        for (size_t axis = 0; axis < 3; ++axis)
            place.at[static_cast<Eigen::Index>(axis)] =
                static_cast<double>(entry.at[axis] - cell.corner[axis]) / cell.size;
        const std::array<double, 8> weights = place.weights();
        for (size_t k = 0; k < 8; ++k)
            if (weights[k] > 0) add_terms(find(cell, k), weight * weights[k], sum);
    }

    const Lattice& lattice_;
    std::unordered_map<uint64_t, size_t> known_;
    std::vector<Entry> all_;
    std::vector<size_t> order_;  // per node
    size_t free_ = 0;
};

void Lattice::number_nodes() {
    const Corners corners(*this);
    free_ = corners.free();
    for (Cell& cell : cells_)
        for (size_t k = 0; k < 8; ++k) cell.node[k] = corners.node(cell, k);
    first_term_.push_back(0);
    for (size_t node = 0; node < corners.size(); ++node) {
        const Corner& at = corners.at(node);
        nodes_.push_back(low_ + step_ * Eigen::Vector3d(at[0], at[1], at[2]));
        for (const auto& [of, weight] : corners.terms(node)) terms_.push_back({of, weight});
        first_term_.push_back(terms_.size());
    }
}

Lattice::Place Lattice::find(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d steps = (place - low_) / step_;
    for (int axis = 0; axis < 3; ++axis)
        if (!(steps[axis] >= 0 && steps[axis] <= count_[static_cast<size_t>(axis)])) return {};
    Corner fine;
    for (size_t axis = 0; axis < 3; ++axis)
        fine[axis] = std::min(static_cast<int32_t>(steps[static_cast<Eigen::Index>(axis)]),
                              count_[axis] - 1);
    Place found;
    found.cell = cell_at(fine);
    if (found.cell < 0) return found;
    const Cell& cell = cells_[static_cast<size_t>(found.cell)];
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        found.at[i] = (steps[i] - cell.corner[axis]) / cell.size;
    }
    return found;
}

Eigen::Vector3d Lattice::position(const Place& place) const {
    const Cell& cell = cells_[static_cast<size_t>(place.cell)];
    return low_ + step_ * (Eigen::Vector3d(cell.corner[0], cell.corner[1], cell.corner[2]) +
                           cell.size * place.at);
}

void Lattice::find_nearer(size_t cell, const Eigen::Vector3d& place, double& squared,
                          Place& nearest) const {
    Place candidate{static_cast<int32_t>(cell)};
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        candidate.at[k] = std::clamp(
            ((place[k] - low_[k]) / step_ - cells_[cell].corner[axis]) / cells_[cell].size, 0.0,
            1.0);
    }
    const double distance = (position(candidate) - place).squaredNorm();
    if (!(distance < squared)) return;
    squared = distance;
    nearest = candidate;
}

Lattice::Place Lattice::find_near(const Eigen::Vector3d& place, double reach) const {
    Place found = find(place);
    if (found.cell >= 0) return found;
    // Shells of cubes around the one nearest to the place, as long as one may be nearer than what
    // was found.
    const double edge = kLargest * step_;
    Corner centre, cubes;
    double outside = 0;  // of the box, squared
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        cubes[axis] = count_[axis] / kLargest;
        const double at = place[k] - low_[k], end = cubes[axis] * edge,
                     inside = std::clamp(at, 0.0, end);
        outside += (at - inside) * (at - inside);
        centre[axis] = std::min(cubes[axis] - 1, static_cast<int32_t>(inside / edge));
    }
    double least = reach * reach;
    const int32_t shells = *std::max_element(cubes.begin(), cubes.end());
    for (int32_t shell = 0; shell < shells; ++shell) {
        const double gap = std::max(0, shell - 1) * edge;
        if (outside + gap * gap >= least) break;
        for (int32_t z = -shell; z <= shell; ++z)
            for (int32_t y = -shell; y <= shell; ++y) {
                const bool is_face = std::max(std::abs(z), std::abs(y)) == shell;
                for (int32_t x = -shell; x <= shell; x += is_face ? 1 : 2 * shell) {
                    const Corner cube{centre[0] + x, centre[1] + y, centre[2] + z};
                    bool is_inside = true;
                    for (size_t axis = 0; axis < 3; ++axis)
                        is_inside &= cube[axis] >= 0 && cube[axis] < cubes[axis];
                    if (!is_inside) continue;
                    const auto index =
                        static_cast<size_t>((cube[2] * cubes[1] + cube[1]) * cubes[0] + cube[0]);
                    for (size_t i = block_begin_[index]; i < block_begin_[index + 1]; ++i)
                        find_nearer(i, place, least, found);
                }
            }
    }
    return found;
}

}  // namespace defrec
