// See slip_monitor.hpp.
#include "sdk/tracking/monitors/slip_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "backends/shared/motion.hpp"
#include "backends/shared/rigid_fit.hpp"
#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/template/surface_point.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/monitors/band.hpp"
#include "sdk/tracking/monitors/window_match.hpp"

namespace defrec {
namespace {

using decisions::Slips;

using Motion = DualQuaternion<double>;

// How the surface on one side of a band moves, near one of its slices.
struct Side {
    Motion motion;
    double nearest = 0;  // cells across from the band's middle, to what is seen
};

// A band's slice across.
struct Slice {
    double along = 0, middle = 0;  // cells from the axis' centre
    std::array<Side, 2> sides;     // towards negative and positive offsets across
};

// mm that a vertex has moved from rest.
Eigen::Vector3f displacement(const TemplateData& data, const FrameOutput& output, int32_t vertex) {
    const auto index = static_cast<size_t>(vertex);
    return Eigen::Map<const Eigen::Vector3f>(output.samples[index].position) -
           Eigen::Map<const Eigen::Vector3f>(data.vertices[index].position);
}

class SlidingBand {
  public:
    // goes_on_from: the end of a line that was released.
    SlidingBand(const TemplateData& data, const FrameOutput& output,
                std::span<const uint8_t> is_confirmed, SlidingPart part,
                const std::optional<Cell>& goes_on_from = {})
        : data_(data),
          output_(output),
          is_confirmed_(is_confirmed),
          band_(std::move(part.band)),
          axis_(axis_along(band_, part.along)),
          goes_on_from_(goes_on_from) {}

    bool may_be_line() const {
        const double spacing = node_spacing(data_);
        return is_line(band_, axis_, spacing) ||
               (goes_on_from_ && axis_.length() >= Slips::kMinGoingOn * spacing);
    }
    // As a part of a band, after slides_somewhere().
    SlidingPart part() const { return {band_, axis_.along, slip_}; }

    // Whether what is seen on both sides of a small part of a band moved by different amounts,
    // along any direction, which becomes its axis.
    bool slides_somewhere() {
        double most = 0;
        Cell along = axis_.along;
        const Cell centre = axis_.centre;
        for (int k = 0; k < Slips::kDirections; ++k) {
            const double angle = std::numbers::pi * k / Slips::kDirections;
            const Cell ahead(std::cos(angle), std::sin(angle));
            axis_ = {centre, ahead, {-ahead.y(), ahead.x()}, 0, 0};  // its extent does not matter
            Slice slice;
            if (!may_slide() || !find_side(slice, 0) || !find_side(slice, 1)) continue;
            const std::optional<SlipAt> slip = slip_at(slice);
            if (!slip || slip->aside > Slips::kMaxAside * std::abs(slip->along) ||
                std::abs(slip->along) <= most)
                continue;
            most = std::abs(slip->along);
            along = slip->along > 0 ? slip->direction : Cell(-slip->direction);
        }
        axis_ = axis_along(band_, along);
        slip_ = most;
        return most >= Slips::kMinSlip * data_.node_spacing_mm;
    }

    // Whether what is seen on both sides moved along the band by different amounts.
    bool slides() {
        find_slices();
        if (static_cast<double>(slices_.size() * Slips::kSliceStep) <
            Slips::kMinSlices * axis_.length())
            return false;
        std::vector<double> along, aside;
        for (const Slice& slice : slices_) {
            const std::optional<SlipAt> slip = slip_at(slice);
            if (!slip) continue;
            along.push_back(slip->along);
            aside.push_back(slip->aside);
        }
        if (along.empty()) return false;
        const double middle = median(along), least = Slips::kMinSlip * data_.node_spacing_mm;
        const auto alike = std::count_if(along.begin(), along.end(), [&](double slip) {
            return slip * middle > 0 && std::abs(slip) >= Slips::kAlike * std::abs(middle);
        });
        if (std::abs(middle) < least ||
            static_cast<double>(alike) < Slips::kMinAlike * static_cast<double>(along.size()) ||
            median(std::move(aside)) > Slips::kMaxAside * std::abs(middle))
            return false;
        slip_along_ = middle;
        extend();
        return true;
    }

    // The line between what moves with one side and what moves with the other, by the image; after
    // slides().
    Slip locate(std::span<const uint8_t> image) const {
        const std::vector<double> offsets = split(image);
        std::vector<Cell> line;
        for (size_t i = 0; i < slices_.size(); ++i)
            line.push_back(axis_.at(slices_[i].along, offsets[i]));
        std::array<bool, 2> ends_free = {true, true};
        if (goes_on_from_) {
            const double at = released_at();
            if (at < slices_.front().along) {
                line.insert(line.begin(), *goes_on_from_);
                ends_free[0] = false;
            } else if (at > slices_.back().along) {
                line.push_back(*goes_on_from_);
                ends_free[1] = false;
            }
        }
        const std::array<Cell, 2> ahead = directions(line);
        std::array<Cell, 2> beyond = {Cell::Zero(), Cell::Zero()};
        for (const size_t end : {0, 1})
            if (ends_free[end])
                beyond[end] =
                    to_border(end == 0 ? line.front() : line.back(), ahead[end]) * ahead[end];
        Slip slip{as_cut(std::move(line), band_, data_.grid, beyond), {}};
        move_nodes(offsets, slip);
        return slip;
    }

  private:
    // Cells from the axis' centre to the end of the released line; only where it goes on from one.
    double released_at() const { return axis_.along.dot(*goes_on_from_ - axis_.centre); }

    void find_slices() {
        for (const Cell& cell : middle_line(band_, axis_)) {
            const double at = axis_.along.dot(cell - axis_.centre);
            if (!slices_.empty() && at < slices_.back().along + Slips::kSliceStep) continue;
            Slice slice{at, axis_.across.dot(cell - axis_.centre), {}};
            if (find_side(slice, 0) && find_side(slice, 1)) slices_.push_back(slice);
        }
    }

    // How far the sides slide at a slice, which is told about them, of the median; nothing: not
    // both are seen.
    std::optional<double> share_at(Slice& slice) const {
        if (!find_side(slice, 0) || !find_side(slice, 1)) return std::nullopt;
        const std::optional<SlipAt> found = slip_at(slice);
        return found ? std::optional(found->along / slip_along_) : std::nullopt;
    }

    // As far as the sides slide beyond its ends, and no line was released.
    void extend() {
        const double released = goes_on_from_ ? released_at() : 0;
        for (const int end : {0, 1}) {
            const auto at = [&]() -> const Slice& {
                return end == 0 ? slices_.front() : slices_.back();
            };
            const size_t apart = std::min<size_t>(slices_.size() - 1, Slips::kSlopeSlices);
            const Slice& inner = slices_[end == 0 ? apart : slices_.size() - 1 - apart];
            const double step = end == 0 ? -static_cast<double>(Slips::kSliceStep)
                                         : static_cast<double>(Slips::kSliceStep),
                         slope = apart == 0
                                     ? 0
                                     : (at().middle - inner.middle) / (at().along - inner.along);
            for (;;) {
                Slice next{at().along + step, at().middle + slope * step, {}};
                if (released * step > 0 && std::abs(next.along) > std::abs(released)) break;
                if (vertex_at(data_.grid, axis_.at(next.along, next.middle), band_.piece) < 0 ||
                    share_at(next).value_or(0) < Slips::kAlike)
                    break;
                slices_.insert(end == 0 ? slices_.begin() : slices_.end(), next);
            }
        }
    }

    bool is_seen(const Cell& cell, int32_t& vertex) const {
        vertex = vertex_at(data_.grid, cell, band_.piece);
        return vertex >= 0 && is_confirmed_[static_cast<size_t>(vertex)] != 0 &&
               output_.samples[static_cast<size_t>(vertex)].observation == DEFREC_OBSERVED;
    }

    // Spares the fits where the nearest that is seen on either side moved alike.
    bool may_slide() const {
        Eigen::Vector3f moved[2];
        for (const int side : {0, 1}) {
            int32_t vertex = -1;
            double steps = 1;
            const double reach = Slips::kReach * node_spacing(data_);
            while (steps <= reach && !is_seen(axis_.at(0, side == 0 ? -steps : steps), vertex))
                ++steps;
            if (steps > reach) return false;
            moved[side] = displacement(data_, output_, vertex);
        }
        return (moved[1] - moved[0]).norm() >= Slips::kMayHaveSlid * data_.node_spacing_mm;
    }

    // By what is seen there of the tissue beside the band.
    bool find_side(Slice& slice, size_t which) const {
        const double sign = which == 0 ? -1 : 1, spacing = node_spacing(data_);
        const int width = static_cast<int>(spacing),
                  depth = static_cast<int>(Slips::kSideDepth * spacing),
                  reach = static_cast<int>(Slips::kReach * spacing);
        RigidFit fit;
        size_t count = 0;
        int nearest = reach + 1;
        for (int aside = -width; aside <= width; ++aside) {
            int first = reach + 1;
            for (int steps = 1; steps <= std::min(reach + depth, first + depth); ++steps) {
                int32_t vertex;
                if (!is_seen(axis_.at(slice.along + aside, slice.middle + sign * steps), vertex))
                    continue;
                if (first > reach) {
                    if (steps > reach) break;
                    first = steps;
                }
                const auto index = static_cast<size_t>(vertex);
                fit.add(1, load3<double>(data_.vertices[index].position),
                        load3<double>(output_.samples[index].position));
                ++count;
            }
            nearest = std::min(nearest, first);
        }
        if (count < Slips::kMinSeen) return false;
        slice.sides[which] = {normalise(fit.solve()), static_cast<double>(nearest)};
        return true;
    }

    bool place_at(const Slice& slice, double offset, SurfacePlace& place) const {
        const Cell cell = axis_.at(slice.along, offset);
        return surface_place(data_, cell.x() * data_.grid.spacing, cell.y() * data_.grid.spacing,
                             place);
    }

    // How far one side is from where the other one's motion has it.
    struct SlipAt {
        double along = 0, aside = 0;  // mm, along the axis and across it
        Cell direction;               // in the first view, of length 1
    };
    std::optional<SlipAt> slip_at(const Slice& slice) const {
        SurfacePlace place;
        if (!place_at(slice, slice.middle, place)) return std::nullopt;
        const auto moved = [&](const Side& side, const Eigen::Vector3d& point) {
            const Vec3<double> at = apply(side.motion, {point.x(), point.y(), point.z()});
            return Eigen::Vector3d(at.x, at.y, at.z);
        };
        const Eigen::Vector3d from = moved(slice.sides[0], place.position),
                              slip = moved(slice.sides[1], place.position) - from;
        Eigen::Matrix<double, 3, 2> tangents;
        tangents.col(0) = moved(slice.sides[0], place.position + place.tangent_u) - from;
        tangents.col(1) = moved(slice.sides[0], place.position + place.tangent_v) - from;
        const Eigen::Vector3d ahead = (tangents * axis_.along).normalized();
        const double along = ahead.dot(slip);
        const Cell direction =
            (tangents.transpose() * tangents).ldlt().solve(tangents.transpose() * slip);
        return SlipAt{along, (slip - along * ahead).norm(), direction.normalized()};
    }

    // The offset across, per slice, between what each side's motion explains: the largest sum of
    // ZNCC over all slices, less kBend for each cell by which neighbours differ (Viterbi 1967).
    std::vector<double> split(std::span<const uint8_t> image) const {
        int low = 0, high = 0;
        for (const Slice& slice : slices_) {
            low = std::min(low, static_cast<int>(slice.middle - slice.sides[0].nearest));
            high = std::max(high, static_cast<int>(slice.middle + slice.sides[1].nearest) + 1);
        }
        const auto states = static_cast<size_t>(high - low + 1);
        std::vector<double> best(states, 0);
        std::vector<std::vector<size_t>> from;
        for (const Slice& slice : slices_) {
            const std::vector<double> gains = gains_of(slice, low, states, image);
            std::vector<double> next(states);
            from.emplace_back(states);
            for (size_t s = 0; s < states; ++s) {
                next[s] = -std::numeric_limits<double>::infinity();
                for (size_t k = 0; k < states; ++k) {
                    const double sum = best[k] - Slips::kBend * std::abs(static_cast<double>(s) -
                                                                         static_cast<double>(k));
                    if (sum > next[s]) {
                        next[s] = sum;
                        from.back()[s] = k;
                    }
                }
                next[s] += gains[s];
            }
            best = std::move(next);
        }
        auto state = static_cast<size_t>(std::max_element(best.begin(), best.end()) - best.begin());
        std::vector<double> offsets(slices_.size());
        for (size_t i = slices_.size(); i-- > 0; state = from[i][state])
            offsets[i] = low + static_cast<double>(state) - 0.5;
        return offsets;
    }

    // Per place of the line: the sum of what the sides explain of the slice, if it lies there.
    std::vector<double> gains_of(const Slice& slice, int low, size_t states,
                                 std::span<const uint8_t> image) const {
        const WindowMatch match(data_, image);
        // From the end on that lies in tissue of the side: it need not move rigidly up to the line.
        const auto explained = [&](size_t side) {
            std::vector<std::optional<double>> zncc(states);
            WindowMatch::Shift shift;
            for (size_t k = 0; k < states; ++k) {
                const size_t s = side == 0 ? k : states - 1 - k;
                SurfacePlace place;
                if (place_at(slice, low + static_cast<double>(s), place))
                    zncc[s] = match.zncc(place, slice.sides[side].motion, shift);
            }
            return zncc;
        };
        const auto before = explained(0), beyond = explained(1);
        std::vector<double> gains(states, 0);
        double sum = 0;  // of the advantage of the side before the line
        for (size_t s = 0; s < states; ++s) {
            gains[s] = sum;
            if (before[s] && beyond[s] && std::max(*before[s], *beyond[s]) >= Slips::kMinZncc)
                sum += *before[s] - *beyond[s];
        }
        return gains;
    }

    // In which the line goes on at its ends. Few points of it tell less than the band.
    std::array<Cell, 2> directions(std::span<const Cell> line) const {
        const size_t points = end_points(node_spacing(data_));
        if (line.size() <= points) return {-axis_.along, axis_.along};
        return directions_at_ends(line, points);
    }

    // How many cells a line goes on at its end: out of the surface, or to a line that was released,
    // unless sides are seen on the way that do not slide.
    double to_border(const Cell& end, const Cell& ahead) const {
        const double beyond = decisions::Cuts::kBeyond * node_spacing(data_);
        const auto pixel_of = [&](const Cell& cell) -> ViewPixel {
            return {cell.x() * data_.grid.spacing, cell.y() * data_.grid.spacing};
        };
        for (double steps = 1;; ++steps) {
            const Cell at = end + steps * ahead;
            if (vertex_at(data_.grid, at, band_.piece) < 0) return steps + beyond;
            if (is_parted(data_.node_grid.cuts, band_.piece, pixel_of(end), pixel_of(at)))
                return steps;
            Slice slice{
                axis_.along.dot(at - axis_.centre), axis_.across.dot(at - axis_.centre), {}};
            if (share_at(slice).value_or(1) < Slips::kEnds) return beyond;
        }
    }

    void move_nodes(const std::vector<double>& offsets, Slip& slip) const {
        const NodeGrid& grid = data_.node_grid;
        for (size_t cell = 0; cell < grid.cells(); ++cell) {
            const int32_t node = grid.node[band_.piece * grid.cells() + cell];
            if (node < 0) continue;
            const size_t columns = static_cast<size_t>(grid.columns), column = cell % columns,
                         row = cell / columns;
            const Cell at = Cell(static_cast<double>(column) * grid.spacing_u,
                                 static_cast<double>(row) * grid.spacing_v) /
                            data_.grid.spacing;
            const double along = axis_.along.dot(at - axis_.centre),
                         beside = axis_.across.dot(at - axis_.centre);
            size_t nearest = 0;
            for (size_t i = 1; i < slices_.size(); ++i)
                if (std::abs(slices_[i].along - along) < std::abs(slices_[nearest].along - along))
                    nearest = i;
            const Slice& slice = slices_[nearest];
            if (std::abs(slice.along - along) > Slips::kMovedBeyond * node_spacing(data_) ||
                beside < slice.middle - slice.sides[0].nearest ||
                beside > slice.middle + slice.sides[1].nearest)
                continue;
            slip.motions.emplace_back(
                static_cast<size_t>(node),
                slice.sides[beside < offsets[nearest] ? 0 : 1].motion.store());
        }
    }

    const TemplateData& data_;
    const FrameOutput& output_;
    const std::span<const uint8_t> is_confirmed_;
    const Band band_;
    BandAxis axis_;
    const std::optional<Cell> goes_on_from_;
    double slip_ = 0;        // mm
    double slip_along_ = 0;  // mm, along the axis, in the median; by slides()
    std::vector<Slice> slices_;
};

// Whether the check of a vertex was to be found, and was not.
class Unconfirmed {
  public:
    Unconfirmed(const TemplateData& data, const FrameOutput& output,
                std::span<const uint8_t> is_confirmed)
        : data_(data),
          output_(output),
          is_confirmed_(is_confirmed),
          inside_u_(data.width),
          inside_v_(data.height) {}

    bool at(size_t cell) const {
        const int32_t index = data_.grid.vertex[cell];
        if (index < 0) return false;
        const auto vertex = static_cast<size_t>(index);
        const int32_t check = data_.check_of_vertex[vertex];
        if (check < 0 || is_confirmed_[vertex] != 0) return false;
        const defrec_patch_prediction& expected =
            output_.check_predictions[static_cast<size_t>(check)];
        const uint32_t observation = output_.samples[vertex].observation;
        return expected.valid != 0 && inside_u_.has(expected.u) && inside_v_.has(expected.v) &&
               (observation == DEFREC_OBSERVED || observation == DEFREC_INCONSISTENT);
    }

  private:
    // Far enough from both borders of an image.
    struct Inside {
        explicit Inside(uint32_t size)
            : from(static_cast<int32_t>(Slips::kMargin * size * 256)),
              to(static_cast<int32_t>(size * 256) - from) {}
        bool has(int32_t at) const { return at >= from && at <= to; }
        int32_t from, to;  // px / 256
    };

    const TemplateData& data_;
    const FrameOutput& output_;
    const std::span<const uint8_t> is_confirmed_;
    const Inside inside_u_, inside_v_;
};

// The parts of the marked cells beside which the surface slides.
std::vector<SlidingPart> sliding_parts(const TemplateData& data, const FrameOutput& output,
                                       std::span<const uint8_t> is_confirmed,
                                       std::vector<uint8_t> open, const Services* helpers) {
    std::vector<Band> bands;
    for (size_t i = 0; i < open.size(); ++i) {
        if (open[i] == 0) continue;
        // Tissue that is not seen on one side of a line makes a band too wide to see across.
        for (Band& band :
             in_squares(take_band(data.grid, open, i), Slips::kSquare * node_spacing(data)))
            if (band.cells.size() >= Slips::kMinCells) bands.push_back(std::move(band));
    }
    std::vector<std::optional<SlidingPart>> found(bands.size());
    helped_loop(helpers, bands.size(), [&](size_t i) {
        SlidingBand band(data, output, is_confirmed, {std::move(bands[i]), {1, 0}});
        if (band.slides_somewhere()) found[i] = band.part();
    });
    std::vector<SlidingPart> parts;
    for (std::optional<SlidingPart>& part : found)
        if (part) parts.push_back(std::move(*part));
    return parts;
}

// Along the way in which sides slide what belongs together lies farther apart than across: between
// its parts a line is not seen where tissue is smooth.
bool is_near(const SlidingPart& part, const Cell& other, double spacing) {
    const Cell across(-part.along.y(), part.along.x());
    return std::any_of(part.band.cells.begin(), part.band.cells.end(), [&](const Cell& cell) {
        const Cell apart = (cell - other) / spacing;
        const double ahead = apart.dot(part.along) / Slips::kJoinAlong,
                     aside = apart.dot(across) / Slips::kJoin;
        return ahead * ahead + aside * aside <= 1;
    });
}

bool belong_together(const SlidingPart& a, const SlidingPart& b, double spacing) {
    return a.band.piece == b.band.piece &&
           std::abs(a.along.dot(b.along)) >= Slips::kSameDirection &&
           std::any_of(b.band.cells.begin(), b.band.cells.end(),
                       [&](const Cell& cell) { return is_near(a, cell, spacing); });
}

// The end of a released line that is near, and ahead of which the part lies.
std::optional<Cell> released_end(const TemplateData& data, const SlidingPart& part) {
    const double spacing = node_spacing(data);
    for (const CutLine& line : data.node_grid.cuts) {
        if (line.piece != part.band.piece || line.pixels.size() < 2) continue;
        const auto cell_at = [&](size_t i) {
            const auto& [u, v] = line.pixels[i];
            return Cell(u / data.grid.spacing, v / data.grid.spacing);
        };
        const size_t last = line.pixels.size() - 1;
        for (const auto& [at, before] : {std::pair<size_t, size_t>{0, 1}, {last, last - 1}}) {
            const Cell end = cell_at(at), ahead = (end - cell_at(before)).normalized();
            const auto is_ahead = [&](const Cell& cell) {
                return ahead.dot(cell - end) >= -spacing;
            };
            if (std::abs(ahead.dot(part.along)) >= Slips::kSameDirection &&
                is_near(part, end, spacing) &&
                std::all_of(part.band.cells.begin(), part.band.cells.end(), is_ahead))
                return end;
        }
    }
    return std::nullopt;
}

// Joins the parts that lie near each other and slide alike.
std::vector<SlidingPart> join(std::vector<SlidingPart> parts, double spacing) {
    std::vector<SlidingPart> joined;
    while (!parts.empty()) {
        SlidingPart all = std::move(parts.back());
        parts.pop_back();
        for (size_t i = 0; i < parts.size();) {
            if (!belong_together(all, parts[i], spacing)) {
                ++i;
                continue;
            }
            const double sign = all.along.dot(parts[i].along) < 0 ? -1 : 1,
                         share = static_cast<double>(parts[i].band.cells.size()) /
                                 static_cast<double>(all.band.cells.size());
            all.along = (all.along + sign * share * parts[i].along).normalized();
            all.band.cells.insert(all.band.cells.end(), parts[i].band.cells.begin(),
                                  parts[i].band.cells.end());
            parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(i));
            i = 0;
        }
        joined.push_back(std::move(all));
    }
    return joined;
}

// Whether the surface moved differently on both sides of any cell without evidence, along a row or
// a column. Takes no memory: most frames end here.
bool any_moves_otherwise(const TemplateData& data, const FrameOutput& output,
                         const std::vector<uint8_t>& frames) {
    const SurfaceGrid& grid = data.grid;
    const auto reach = static_cast<int>(Slips::kReach * node_spacing(data));
    const auto moved = [&](int x, int y) -> Eigen::Vector3f {
        const int32_t vertex = grid.vertex[static_cast<size_t>(
            std::clamp(y, 0, grid.rows - 1) * grid.columns + std::clamp(x, 0, grid.columns - 1))];
        if (vertex < 0) return Eigen::Vector3f::Zero();
        return displacement(data, output, vertex);
    };
    const auto least = static_cast<float>(Slips::kMayHaveSlid * data.node_spacing_mm);
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x)
            if (frames[static_cast<size_t>(y * grid.columns + x)] == Slips::kFrames &&
                ((moved(x - reach, y) - moved(x + reach, y)).norm() >= least ||
                 (moved(x, y - reach) - moved(x, y + reach)).norm() >= least))
                return true;
    return false;
}

}  // namespace

void SlipMonitor::reset() {
    end_release();
    unconfirmed_.clear();
}

void SlipMonitor::end_release() {
    frames_.clear();
    found_.reset();
    suspected_.reset();
    doubts_.clear();
}

// A surface that follows both sides of a line lies between them: half a slip is the most.
void SlipMonitor::doubt(const TemplateData& data, std::span<const SlidingPart> parts) {
    doubts_.clear();
    if (parts.empty()) return;
    doubts_.resize(data.vertices.size(), 0);
    for (const SlidingPart& part : parts)
        for (const Cell& cell : part.band.cells)
            if (const int32_t vertex = vertex_at(data.grid, cell, part.band.piece); vertex >= 0)
                doubts_[static_cast<size_t>(vertex)] = static_cast<float>(part.slip / 2);
}

void SlipMonitor::add_frame(const TemplateData& data, const FrameOutput& output,
                            std::span<const uint8_t> is_confirmed, std::span<const uint8_t> image,
                            const Services* helpers) {
    if (found_) return;
    const SurfaceGrid& grid = data.grid;
    const Unconfirmed unconfirmed(data, output, is_confirmed);
    frames_.resize(grid.vertex.size(), 0);
    unconfirmed_.resize(grid.vertex.size(), 0);
    is_unconfirmed_.resize(grid.vertex.size());
    for (size_t i = 0; i < is_unconfirmed_.size(); ++i) is_unconfirmed_[i] = unconfirmed.at(i);
    const auto count = [this](std::vector<uint8_t>& frames) {
        return count_frame(frames, Slips::kFrames, [this](size_t i) { return is_unconfirmed_[i]; });
    };
    count(unconfirmed_);
    const size_t cells = count(frames_);
    const double spacing = node_spacing(data);
    if (static_cast<double>(cells) < decisions::Cuts::kMinLength * spacing ||
        !any_moves_otherwise(data, output, frames_)) {
        suspected_.reset();
        doubts_.clear();
        return;
    }
    std::vector<uint8_t> open = open_cells(data, frames_, Slips::kFrames, Slips::kBesideCut);
    std::vector<SlidingPart> bands = sliding_parts(data, output, is_confirmed, open, helpers);
    doubt(data, bands);
    bands = join(std::move(bands), spacing);
    if (suspected_ && !image.empty()) bands.push_back(std::move(*suspected_));
    suspected_.reset();
    for (SlidingPart& joined : bands) {
        SlidingBand band(data, output, is_confirmed, joined, released_end(data, joined));
        if (!band.may_be_line() || !band.slides()) continue;
        if (image.empty())
            suspected_ = std::move(joined);
        else
            found_ = band.locate(image);
        return;
    }
}

}  // namespace defrec
