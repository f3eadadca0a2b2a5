// See lifted_region.hpp.
#include "sdk/tracking/monitors/lifted_region.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sdk/base/util/median.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/monitors/band.hpp"
#include "sdk/tracking/monitors/side_levels.hpp"

namespace defrec {
namespace {

using decisions::Lifted;

enum Label : uint8_t { kNothing, kInPlace, kElsewhere };

// A side of a cell that lies in the region, towards one that does not.
struct Crack {
    size_t inner, outer;             // cells
    int from_x, from_y, to_x, to_y;  // its corners, half a cell above and to the left of a cell
};

class Search {
  public:
    Search(const TemplateData& data, const FrameOutput& output,
           std::span<const uint8_t> is_confirmed)
        : data_(data),
          grid_(data.grid),
          output_(output),
          is_confirmed_(is_confirmed),
          spacing_(node_spacing(data)),
          label_(grid_.vertex.size(), kNothing),
          source_(grid_.vertex.size(), -1) {}

    std::optional<LiftedRegion> find() {
        if (!label_seen()) return std::nullopt;
        spread_labels();
        LiftedRegion region;
        if (!take_largest(region) || !any_torn(region.is_lifted)) return std::nullopt;
        for (const std::vector<Crack>& outline : outlines(region.is_lifted))
            add_tears(outline, region);
        if (region.tears.empty()) return std::nullopt;
        return region;
    }

  private:
    uint8_t piece_of(size_t cell) const {
        return grid_.piece.empty() ? uint8_t{0} : grid_.piece[cell];
    }
    bool is_seen(size_t vertex) const {
        const defrec_surface_sample& sample = output_.samples[vertex];
        return is_confirmed_[vertex] != 0 && has_live_place(sample) &&
               std::abs(sample.residual) <= Lifted::kMaxResidual;
    }
    Vec3<double> rest(size_t vertex) const {
        return load3<double>(data_.vertices[vertex].position);
    }
    Vec3<double> live(size_t vertex) const { return live_place(output_.samples[vertex]); }

    // The rigid motion of what stayed, which is most of the surface.
    void fit_whole() {
        std::vector<PointPair> pairs;
        pairs.reserve(data_.vertices.size() / Lifted::kStep + 1);
        for (size_t i = 0; i < data_.vertices.size(); i += Lifted::kStep)
            if (is_seen(i)) pairs.push_back({rest(i), live(i)});
        DualQuaternion<double> motion = fit_pairs(pairs);
        for (int round = 1; round < Lifted::kRounds; ++round)
            motion = fit_pairs(agreeing_pairs(pairs, motion));
        whole_ = RigidMap(motion);
    }

    // false: too little is seen of what was lifted, or of the whole.
    bool label_seen() {
        fit_whole();
        size_t elsewhere = 0, seen = 0, inside = 0;
        for (size_t cell = 0; cell < label_.size(); ++cell) {
            const int32_t index = grid_.vertex[cell];
            if (index < 0) continue;
            const auto vertex = static_cast<size_t>(index);
            inside += data_.check_of_vertex[vertex] >= 0 &&
                              output_.samples[vertex].observation != DEFREC_OUTSIDE
                          ? 1
                          : 0;
            if (!is_seen(vertex)) continue;
            ++seen;
            const Vec3<double> moved = live(vertex) - whole_(rest(vertex));
            const bool is_elsewhere = dot(moved, moved) >= Lifted::kMinMm * Lifted::kMinMm;
            label_[cell] = is_elsewhere ? kElsewhere : kInPlace;
            source_[cell] = index;
            elsewhere += is_elsewhere ? 1 : 0;
        }
        return static_cast<double>(elsewhere) >= Lifted::kMinNodes * spacing_ * spacing_ &&
               static_cast<double>(seen) >= Lifted::kMinWhole * static_cast<double>(inside);
    }

    template <class Visit>  // visit(cell)
    void visit_beside(size_t cell, const Visit& visit) const {
        // Numbers of 32 bits are divided in a third of the time.
        const auto columns = static_cast<uint32_t>(grid_.columns),
                   index = static_cast<uint32_t>(cell);
        const uint32_t x = index % columns, y = index / columns;
        if (x > 0) visit(cell - 1);
        if (x + 1 < columns) visit(cell + 1);
        if (y > 0) visit(cell - columns);
        if (y + 1 < static_cast<uint32_t>(grid_.rows)) visit(cell + columns);
    }

    bool is_beside_unlabelled(size_t cell) const {
        bool is_beside = false;
        visit_beside(cell, [&](size_t beside) { is_beside |= label_[beside] == kNothing; });
        return is_beside;
    }

    // Every cell gets the label of the nearest one that has one.
    void spread_labels() {
        std::vector<size_t> front, next;
        front.reserve(label_.size());
        for (size_t cell = 0; cell < label_.size(); ++cell)
            if (label_[cell] != kNothing && is_beside_unlabelled(cell)) front.push_back(cell);
        for (; !front.empty(); front.swap(next)) {
            next.clear();
            for (const size_t cell : front)
                visit_beside(cell, [&](size_t beside) {
                    if (label_[beside] != kNothing || piece_of(beside) != piece_of(cell) ||
                        is_parted(data_.node_grid.cuts, piece_of(cell), pixel_of(cell),
                                  pixel_of(beside)))
                        return;
                    label_[beside] = label_[cell];
                    source_[beside] = source_[cell];
                    next.push_back(beside);
                });
        }
    }

    bool take_largest(LiftedRegion& region) {
        std::vector<uint32_t> cells;  // of all regions, one after the other
        cells.reserve(label_.size());
        size_t first = 0, last = 0, most_seen = 0;  // of the largest
        std::vector<uint8_t> is_open(label_.size());
        for (size_t cell = 0; cell < label_.size(); ++cell)
            is_open[cell] = label_[cell] == kElsewhere;
        for (size_t from = 0; from < is_open.size(); ++from) {
            if (is_open[from] == 0) continue;
            const size_t begin = cells.size();
            cells.push_back(static_cast<uint32_t>(from));
            is_open[from] = 0;
            size_t seen = 0;
            for (size_t i = begin; i < cells.size(); ++i) {
                const size_t cell = cells[i];
                seen += grid_.vertex[cell] >= 0 && source_[cell] == grid_.vertex[cell] ? 1 : 0;
                visit_beside(cell, [&](size_t beside) {
                    if (is_open[beside] == 0 || piece_of(beside) != piece_of(cell)) return;
                    is_open[beside] = 0;
                    cells.push_back(static_cast<uint32_t>(beside));
                });
            }
            if (seen <= most_seen) continue;
            most_seen = seen;
            first = begin;
            last = cells.size();
        }
        if (static_cast<double>(most_seen) < Lifted::kMinNodes * spacing_ * spacing_) return false;
        const auto largest = std::span(cells).subspan(first, last - first);
        region.piece = piece_of(largest.front());
        region.is_lifted.assign(label_.size(), 0);
        for (const size_t cell : largest) {
            region.is_lifted[cell] = 1;
            const int32_t vertex = grid_.vertex[cell];
            if (vertex < 0 || source_[cell] != vertex) continue;
            const auto i = static_cast<size_t>(vertex);
            region.pairs.push_back({rest(i), live(i)});
        }
        return true;
    }

    // Closed, each crack's end being the next one's beginning; the region lies to the right.
    std::vector<std::vector<Crack>> outlines(const std::vector<uint8_t>& is_lifted) const {
        std::multimap<std::pair<int, int>, Crack> from;
        const auto outer_of = [&](int x, int y) -> std::optional<size_t> {
            if (x < 0 || y < 0 || x >= grid_.columns || y >= grid_.rows) return std::nullopt;
            return static_cast<size_t>(y * grid_.columns + x);
        };
        for (int y = 0; y < grid_.rows; ++y)
            for (int x = 0; x < grid_.columns; ++x) {
                const auto cell = static_cast<size_t>(y * grid_.columns + x);
                if (is_lifted[cell] == 0) continue;
                const auto add = [&](std::optional<size_t> outer, int a, int b, int c, int d) {
                    if (outer && is_lifted[*outer] != 0) return;
                    from.emplace(std::pair(x + a, y + b),
                                 Crack{cell, outer.value_or(cell), x + a, y + b, x + c, y + d});
                };
                add(outer_of(x, y - 1), 0, 0, 1, 0);
                add(outer_of(x + 1, y), 1, 0, 1, 1);
                add(outer_of(x, y + 1), 1, 1, 0, 1);
                add(outer_of(x - 1, y), 0, 1, 0, 0);
            }
        std::vector<std::vector<Crack>> outlines;
        while (!from.empty()) {
            std::vector<Crack>& outline = outlines.emplace_back();
            for (auto next = from.begin(); next != from.end();
                 next = from.find({outline.back().to_x, outline.back().to_y})) {
                outline.push_back(next->second);
                from.erase(next);
            }
        }
        return outlines;
    }

    ViewPixel pixel_of(size_t cell) const {
        const auto columns = static_cast<size_t>(grid_.columns);
        const size_t column = cell % columns, row = cell / columns;
        return {static_cast<double>(column) * grid_.spacing,
                static_cast<double>(row) * grid_.spacing};
    }

    // Whether what is seen in two cells beside each other came apart, the inner towards the camera;
    // 1: torn, 0.5: it may be, 0: not.
    double torn(size_t inner, size_t outer) const {
        if (outer == inner || piece_of(outer) != piece_of(inner)) return 0;
        const int32_t a = source_[inner], b = source_[outer];
        if (a < 0 || b < 0) return 0;
        const auto i = static_cast<size_t>(a), k = static_cast<size_t>(b);
        const Vec3<double> now = live(i) - live(k), before = rest(i) - rest(k),
                           moved = now - whole_.turned(before);
        const double apart = std::sqrt(dot(moved, moved));
        const double stretch = std::sqrt(dot(now, now) / std::max(1e-6, dot(before, before)));
        if (stretch < Lifted::kMaybeTorn || -moved.z < Lifted::kAlongSight * apart) return 0;
        return stretch >= Lifted::kTorn && apart >= Lifted::kMinMm ? 1 : 0.5;
    }

    // Whether anything came apart at the region's outline, which takes less than to follow that.
    bool any_torn(const std::vector<uint8_t>& is_lifted) const {
        for (size_t cell = 0; cell < is_lifted.size(); ++cell) {
            if (is_lifted[cell] == 0) continue;
            bool is_torn = false;
            visit_beside(cell, [&](size_t beside) {
                is_torn |= is_lifted[beside] == 0 && torn(cell, beside) == 1;
            });
            if (is_torn) return true;
        }
        return false;
    }

    // mm that each cell's tissue moved along the sight, beyond the whole's motion; not a number
    // where it is not seen.
    std::vector<float> moved_along_sight() const {
        std::vector<float> moved(label_.size(), std::numeric_limits<float>::quiet_NaN());
        for (size_t cell = 0; cell < label_.size(); ++cell) {
            if (grid_.vertex[cell] < 0 || source_[cell] != grid_.vertex[cell]) continue;
            const auto i = static_cast<size_t>(grid_.vertex[cell]);
            moved[cell] = static_cast<float>((live(i) - whole_(rest(i))).z);
        }
        return moved;
    }

    // Whether the sides of what seems torn go on at different heights. They do not where tissue
    // only rises steeply, nor where an instrument hides how it rises.
    bool stands_off(const std::vector<Crack>& outline, const std::vector<double>& apart,
                    std::span<const uint8_t> is_lifted) const {
        const std::vector<float> moved = moved_along_sight();
        const SideLevels levels(grid_, is_lifted, moved);
        std::vector<double> steps;
        for (size_t i = 0; i < outline.size(); ++i) {
            if (apart[i] == 0) continue;
            const Crack& crack = outline[i];
            const Cell middle((crack.from_x + crack.to_x - 1) / 2.0,
                              (crack.from_y + crack.to_y - 1) / 2.0);
            if (const std::optional<double> step =
                    levels.step_at(middle, piece_of(crack.inner), Lifted::kLevelReach * spacing_))
                steps.push_back(*step);
        }
        return static_cast<double>(steps.size()) >= Lifted::kMinLength * spacing_ &&
               median(std::move(steps)) <= -std::max(Lifted::kMinMm, Lifted::kMinOfNoise * noise());
    }

    // mm that live depth lies from the surface, in the median.
    double noise() const {
        std::vector<double> residuals;
        for (size_t cell = 0; cell < label_.size(); ++cell)
            if (grid_.vertex[cell] >= 0 && source_[cell] == grid_.vertex[cell])
                residuals.push_back(std::abs(
                    double{output_.samples[static_cast<size_t>(grid_.vertex[cell])].residual}));
        return median(std::move(residuals));
    }

    // Whether the region came off along most of its outline, and lies within the image.
    static bool is_torn_off(const std::vector<Crack>& outline, const std::vector<double>& apart) {
        const auto share = [&](auto count) {
            return static_cast<double>(count) / static_cast<double>(outline.size());
        };
        return std::any_of(apart.begin(), apart.end(), [](double a) { return a == 1; }) &&
               share(std::count_if(apart.begin(), apart.end(), [](double a) { return a > 0; })) >=
                   Lifted::kMinTornShare &&
               share(std::count_if(outline.begin(), outline.end(), [](const Crack& crack) {
                   return crack.inner == crack.outer;
               })) <= Lifted::kMaxBorderShare;
    }

    void add_tears(const std::vector<Crack>& outline, LiftedRegion& region) const {
        const size_t count = outline.size();
        std::vector<double> apart(count);
        for (size_t i = 0; i < count; ++i) apart[i] = torn(outline[i].inner, outline[i].outer);
        if (!is_torn_off(outline, apart) || !stands_off(outline, apart, region.is_lifted)) return;
        for (int direction = 0; direction < 2; ++direction) {  // what may be torn beside what is
            for (size_t step = 0; step < 2 * count; ++step) {
                const size_t i = step % count, k = (step + 1) % count;
                if (apart[i] == 1 && apart[k] == 0.5) apart[k] = 1;
            }
            std::reverse(apart.begin(), apart.end());
        }
        // Begins after the longest part that is not torn, which is the hinge.
        size_t begin = 0, longest = 0, run = 0;
        for (size_t step = 0; step < 2 * count; ++step) {
            run = apart[step % count] == 1 ? 0 : run + 1;
            if (run <= longest || run > count) continue;
            longest = run;
            begin = (step + 1) % count;
        }
        const double bridged = Lifted::kBridged * spacing_;
        for (size_t step = 0; step < count;) {
            if (apart[(begin + step) % count] != 1) {
                ++step;
                continue;
            }
            size_t end = step;  // of the last crack that is torn
            for (size_t k = step; k < count && static_cast<double>(k - end) <= bridged; ++k)
                if (apart[(begin + k) % count] == 1) end = k;
            add_tear(outline, begin + step, end - step + 1, region);
            step = end + 1;
        }
    }

    // The parts that no cut has parted yet.
    void add_tear(const std::vector<Crack>& outline, size_t first, size_t length,
                  LiftedRegion& region) const {
        const auto is_new = [&](size_t i) {
            const Crack& crack = outline[(first + i) % outline.size()];
            return distance_to_cut(data_.node_grid.cuts, region.piece, pixel_of(crack.inner)) >
                   data_.node_grid.spacing_u;
        };
        const bool is_first = data_.node_grid.cuts.empty();
        for (size_t i = 0; i < length;) {
            size_t end = i;
            while (end < length && is_new(end)) ++end;
            const double least = (is_first ? Lifted::kMinLength : Lifted::kMinLonger) * spacing_;
            if (static_cast<double>(end - i) >= least)
                region.tears.push_back(as_line(outline, first + i, end - i, region.piece));
            i = std::max(end, i + 1);
        }
    }

    CutLine as_line(const std::vector<Crack>& outline, size_t first, size_t length,
                    uint8_t piece) const {
        const auto corner = [&](size_t i) -> Cell {
            if (i == length) {
                const Crack& last = outline[(first + length - 1) % outline.size()];
                return {last.to_x - 0.5, last.to_y - 0.5};
            }
            const Crack& crack = outline[(first + i) % outline.size()];
            return {crack.from_x - 0.5, crack.from_y - 0.5};
        };
        std::vector<Cell> line;
        for (size_t i = 0; i <= length; ++i) {
            Cell sum = Cell::Zero();
            const size_t reach = std::min({i, length - i, static_cast<size_t>(Lifted::kSmooth)});
            for (size_t k = i - reach; k <= i + reach; ++k) sum += corner(k);
            line.push_back(sum / static_cast<double>(2 * reach + 1));
        }
        Band band;
        band.piece = piece;
        return as_cut(std::move(line), band, grid_, spacing_, Lifted::kBeyond * spacing_);
    }

    const TemplateData& data_;
    const SurfaceGrid& grid_;
    const FrameOutput& output_;
    const std::span<const uint8_t> is_confirmed_;
    const double spacing_;  // of control points, cells
    RigidMap whole_{DualQuaternion<double>::identity()};
    std::vector<Label> label_;     // per cell
    std::vector<int32_t> source_;  // per cell: the vertex that gave the label
};

}  // namespace

Vec3<double> live_place(const float position[3], float residual) {
    const Vec3<double> place = load3<double>(position);
    return (1 + double{residual} / place.z) * place;
}

Vec3<double> live_place(const defrec_surface_sample& sample) {
    return live_place(sample.position, sample.residual);
}

bool has_live_place(const defrec_surface_sample& sample) {
    return sample.observation == DEFREC_OBSERVED ||
           (sample.observation != DEFREC_OUTSIDE && sample.observation != DEFREC_NO_DEPTH &&
            sample.residual != 0);
}

bool may_be_torn(const TemplateData& data, std::span<const Vec3<double>> nodes) {
    constexpr double kMost = Lifted::kSuspicious * Lifted::kSuspicious;
    return std::any_of(data.edges.begin(), data.edges.end(), [&](const defrec_edge& edge) {
        const auto a = static_cast<size_t>(edge.a), b = static_cast<size_t>(edge.b);
        const Vec3<double> now = nodes[a] - nodes[b], rest = load3<double>(&data.nodes[3 * a]) -
                                                             load3<double>(&data.nodes[3 * b]);
        return dot(now, now) > kMost * dot(rest, rest);
    });
}

std::optional<LiftedRegion> find_lifted_region(const TemplateData& data, const FrameOutput& output,
                                               std::span<const uint8_t> is_confirmed) {
    return Search(data, output, is_confirmed).find();
}

}  // namespace defrec
