// See body_shape.hpp.
#include "sdk/body/body_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

using decisions::BodyCells, decisions::BodyExtent, decisions::BodyHandles, decisions::BodyStiffness;

Eigen::Vector3d position_of(const defrec_cut_point& point) {
    return Eigen::Map<const Eigen::Vector3f>(point.position).cast<double>();
}

// Places, found by the cube of a grid that they lie in.
class PlaceGrid {
  public:
    explicit PlaceGrid(double side) : side_(side) {}
    void add(const Eigen::Vector3d& place) {
        cells_[key(cell_of(place))].push_back(static_cast<int32_t>(places_.size()));
        places_.push_back(place);
    }
    // The nearest within a side; -1: there is none.
    int32_t nearest(const Eigen::Vector3d& place, double& squared) const {
        int32_t best = -1;
        squared = side_ * side_;
        const Cell cell = cell_of(place);
        for (int64_t z = cell[2] - 1; z <= cell[2] + 1; ++z)
            for (int64_t y = cell[1] - 1; y <= cell[1] + 1; ++y)
                for (int64_t x = cell[0] - 1; x <= cell[0] + 1; ++x) {
                    const auto found = cells_.find(key({x, y, z}));
                    if (found == cells_.end()) continue;
                    for (const int32_t item : found->second) {
                        const double distance =
                            (places_[static_cast<size_t>(item)] - place).squaredNorm();
                        if (distance >= squared) continue;
                        squared = distance;
                        best = item;
                    }
                }
        return best;
    }
    size_t size() const { return places_.size(); }

  private:
    using Cell = std::array<int64_t, 3>;
    Cell cell_of(const Eigen::Vector3d& place) const {
        Cell cell;
        for (size_t axis = 0; axis < 3; ++axis)
            cell[axis] =
                static_cast<int64_t>(std::floor(place[static_cast<Eigen::Index>(axis)] / side_));
        return cell;
    }
    static uint64_t key(const Cell& cell) {
        constexpr int64_t kHalf = int64_t{1} << 20;
        uint64_t value = 0;
        for (const int64_t c : cell) value = value << 21 | static_cast<uint64_t>(c + kHalf);
        return value;
    }

    double side_;
    std::vector<Eigen::Vector3d> places_;
    std::unordered_map<uint64_t, std::vector<int32_t>> cells_;
};

// From the line between two points.
double line_distance(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                     const Eigen::Vector3d& place) {
    const Eigen::Vector3d along = to - from;
    const double squared = along.squaredNorm();
    const double at = squared > 0 ? std::clamp((place - from).dot(along) / squared, 0.0, 1.0) : 0.0;
    return (from + at * along - place).norm();
}

template <class Visit>
void visit_cuts(std::span<const defrec_cut_point> cuts, const Visit& visit) {
    for (size_t i = 1; i < cuts.size(); ++i)
        if (cuts[i].cut == cuts[i - 1].cut) visit(position_of(cuts[i - 1]), position_of(cuts[i]));
}

bool lies_on_cut(std::span<const defrec_cut_point> cuts, const Eigen::Vector3d& place,
                 double reach) {
    bool lies = false;
    visit_cuts(cuts, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        lies = lies || line_distance(from, to, place) < reach;
    });
    return lies;
}

size_t count_handles(const BodySurface& surface, double step) {
    size_t count = 0;
    for (const std::vector<Handle>& handles : make_handles(surface, step)) count += handles.size();
    return count;
}

}  // namespace

std::vector<std::vector<Handle>> make_handles(const BodySurface& surface, double step) {
    std::vector<std::vector<Handle>> handles(surface.pieces);
    std::vector<uint8_t> is_cut(surface.vertices.size(), 0);
    if (!surface.cuts.empty())
        for (size_t i = 0; i < is_cut.size(); ++i)
            is_cut[i] = lies_on_cut(surface.cuts, position_of(surface.vertices[i]),
                                    BodyHandles::kCutSteps * step);
    for (size_t piece = 0; piece < surface.pieces; ++piece) {
        // A small piece may lie beside cuts as a whole.
        bool any_whole = false;
        for (size_t i = 0; i < is_cut.size(); ++i)
            any_whole |= surface.piece[i] == piece && is_cut[i] == 0;
        const auto takes_part = [&](size_t i) {
            return surface.piece[i] == piece && (is_cut[i] == 0 || !any_whole);
        };
        // Centres that are not nearer to each other than that, then each vertex with its nearest.
        PlaceGrid centres(step);
        double squared = 0;
        for (size_t i = 0; i < surface.vertices.size(); ++i) {
            const Eigen::Vector3d place = position_of(surface.vertices[i]);
            if (takes_part(i) &&
                (centres.nearest(place, squared) < 0 ||
                 squared >= BodyHandles::kApart * BodyHandles::kApart * step * step))
                centres.add(place);
        }
        std::vector<Handle>& found = handles[piece];
        found.resize(centres.size());
        for (size_t i = 0; i < surface.vertices.size(); ++i) {
            if (!takes_part(i)) continue;
            const Eigen::Vector3d place = position_of(surface.vertices[i]);
            Handle& handle = found[static_cast<size_t>(centres.nearest(place, squared))];
            handle.vertices.push_back(static_cast<uint32_t>(i));
            handle.places.push_back(place.cast<float>());
            handle.position += place;
            handle.normal +=
                Eigen::Map<const Eigen::Vector3f>(surface.vertices[i].normal).cast<double>();
        }
        for (Handle& handle : found) {
            handle.position /= static_cast<double>(handle.vertices.size());
            handle.normal.normalize();
        }
    }
    return handles;
}

double handle_step(const BodySurface& surface) {
    constexpr double kWanted = (BodyHandles::kMin + BodyHandles::kMax) / 2.0;
    double step = BodyHandles::kUsualStep;
    auto count = static_cast<double>(count_handles(surface, step));
    for (int round = 0; round < 6 && (count < BodyHandles::kMin || count > BodyHandles::kMax);
         ++round) {
        const double factor = std::sqrt(std::max(1.0, count) / kWanted),
                     next = std::clamp(step * std::clamp(factor, BodyHandles::kMinFactor,
                                                         BodyHandles::kMaxFactor),
                                       BodyHandles::kMinStep, BodyHandles::kMaxStep);
        const auto found = static_cast<double>(count_handles(surface, next));
        // Each of few vertices is a handle before there are enough.
        if (next < step && found < BodyHandles::kMoreHandles * count) break;
        step = next;
        count = found;
    }
    return step;
}

int32_t nearest_handle(std::span<const Handle> handles, const Eigen::Vector3d& place) {
    int32_t best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < handles.size(); ++i) {
        const double squared = (handles[i].position - place).squaredNorm();
        if (squared >= least) continue;
        least = squared;
        best = static_cast<int32_t>(i);
    }
    return best;
}

BodyShape::BodyShape(const BodySurface& surface, const BodyDescription& description,
                     std::span<const std::vector<Handle>> handles, size_t piece, double step)
    : description_(description), handles_(handles), piece_(piece), step_(step) {
    const std::vector<Handle>& own = handles[piece];
    Eigen::Vector3d low = own.front().position, high = low;
    for (const Handle& handle : own) {
        low = low.cwiseMin(handle.position);
        high = high.cwiseMax(handle.position);
    }
    const double extent = (high - low).maxCoeff();
    depth_mm_ = std::max(BodyExtent::kMinDepth, BodyExtent::kDepthShare * extent);
    margin_mm_ = std::max(BodyExtent::kMarginShare * extent, 2 * step);
    if (description.mesh) {
        low_ = description.mesh->low();
        high_ = description.mesh->high();
    } else {
        low_ = low;
        high_ = high;
        for (const Handle& handle : own) {
            const Eigen::Vector3d deepest = handle.position - depth_mm_ * handle.normal;
            low_ = low_.cwiseMin(deepest);
            high_ = high_.cwiseMax(deepest);
        }
    }
    // So that the finest cells lie about the surface in the same way wherever the body is.
    const Eigen::Vector3d room =
        Eigen::Vector3d::Constant(description.mesh ? 0.5 * step : std::max(margin_mm_, step));
    low_ -= room;
    high_ += room;
    visit_cuts(surface.cuts, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        const int32_t near = nearest_handle(own, (from + to) / 2);
        const Eigen::Vector3d down = -own[static_cast<size_t>(near)].normal;
        const Eigen::Vector3d across = (to - from).cross(down).normalized();
        cuts_.push_back({from, to, down, std::max(1.0, across.lpNorm<1>())});
    });
}

// Beneath this piece and not beneath another one.
bool BodyShape::is_beneath(const Eigen::Vector3d& place) const {
    size_t nearest_piece = 0;
    int32_t nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t piece = 0; piece < handles_.size(); ++piece) {
        const int32_t found = nearest_handle(handles_[piece], place);
        if (found < 0) continue;
        const double squared =
            (handles_[piece][static_cast<size_t>(found)].position - place).squaredNorm();
        if (squared >= least) continue;
        least = squared;
        nearest = found;
        nearest_piece = piece;
    }
    if (nearest_piece != piece_) return false;
    const Handle& handle = handles_[piece_][static_cast<size_t>(nearest)];
    const Eigen::Vector3d from = place - handle.position;
    const double depth = -from.dot(handle.normal);
    return depth >= 0 && depth <= depth_mm_ &&
           (from + depth * handle.normal).squaredNorm() <= margin_mm_ * margin_mm_;
}

double BodyShape::share(const Eigen::Vector3d& centre, double edge) const {
    if (description_.mesh) return description_.mesh->inside_share(centre, edge);
    constexpr int kSamples = 3;  // along an axis
    int inside = 0;
    for (int z = 0; z < kSamples; ++z)
        for (int y = 0; y < kSamples; ++y)
            for (int x = 0; x < kSamples; ++x) {
                const Eigen::Vector3d at(x + 0.5, y + 0.5, z + 0.5);
                inside +=
                    is_beneath(centre + edge * (at / kSamples - Eigen::Vector3d::Constant(0.5)));
            }
    return static_cast<double>(inside) / (kSamples * kSamples * kSamples);
}

bool BodyShape::is_cut(const Eigen::Vector3d& centre, double edge) const {
    return std::any_of(cuts_.begin(), cuts_.end(), [&](const CutSegment& cut) {
        const double depth = (centre - cut.from).dot(cut.down);
        return depth >= -edge && depth <= description_.cut_depth_mm &&
               line_distance(cut.from, cut.to, centre - depth * cut.down) < 0.5 * cut.width * edge;
    });
}

double BodyShape::stiffness(const Eigen::Vector3d& centre, double edge) const {
    const double inside = share(centre, edge);
    if (inside < BodyCells::kMinShare) return 0;
    double value = 1;
    for (const BodyDescription::Region& region : description_.regions) {
        const double of_region = region.mesh.inside_share(centre, edge);
        value = (1 - of_region) * value + of_region * region.stiffness;
    }
    return inside * value * (is_cut(centre, edge) ? BodyStiffness::kCut : 1);
}

Lattice::Request BodyShape::request(const std::function<bool()>& is_wanted) const {
    Lattice::Request request;
    request.step = step_;
    request.low = low_;
    request.high = high_;
    request.max_cells = BodyCells::kMaxCells;
    request.is_wanted = is_wanted;
    request.stiffness = [this](const Eigen::Vector3d& centre, double edge) {
        return stiffness(centre, edge);
    };
    request.distance = [this](const Eigen::Vector3d& place) {
        const std::vector<Handle>& own = handles_[piece_];
        return (own[static_cast<size_t>(nearest_handle(own, place))].position - place).norm();
    };
    return request;
}

// Whether a held region meets the body beneath this piece.
bool BodyShape::is_held() const {
    const double apart = 2 * step_;
    for (const BodyDescription::Region& region : description_.regions) {
        if (!region.is_held) continue;
        for (double z = low_.z(); z <= high_.z(); z += apart)
            for (double y = low_.y(); y <= high_.y(); y += apart)
                for (double x = low_.x(); x <= high_.x(); x += apart)
                    if (region.mesh.inside_share({x, y, z}, apart) > 0) return true;
    }
    return false;
}

SupportStiffness BodyShape::support() const {
    if (is_held())
        return [this](const Eigen::Vector3d& place, double) {
            double held = 0;
            for (const BodyDescription::Region& region : description_.regions)
                if (region.is_held) held = std::max(held, region.mesh.inside_share(place, step_));
            return BodyStiffness::kMin + held * BodyStiffness::kHeld * step_;
        };
    if (description_.mesh)
        return [](const Eigen::Vector3d&, double area) {
            return BodyStiffness::kMin + area / BodyStiffness::kFreeLength;
        };
    const std::vector<Handle>& own = handles_[piece_];
    const double length = BodyExtent::kBeyondShare / BodyExtent::kDepthShare * depth_mm_;
    return [&own, length, rim = BodyExtent::kFreeRimSteps * step_](const Eigen::Vector3d& place,
                                                                   double area) {
        const Handle& handle = own[static_cast<size_t>(nearest_handle(own, place))];
        const double depth = -(place - handle.position).dot(handle.normal);
        return BodyStiffness::kMin + (depth < rim ? 0 : area / length);
    };
}

}  // namespace defrec
