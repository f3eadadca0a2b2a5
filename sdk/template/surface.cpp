#include "sdk/template/surface.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "sdk/base/util/median.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/grid_distance.hpp"

namespace defrec {
namespace {

using decisions::PlaneFit;
using decisions::TemplatePieces;
using decisions::TemplateSurface;

struct Sample {
    double disparity = 0;  // with the camera's offset
    double slope = 0;      // px of disparity per px
    double weight = 0;     // share of the window that had disparity; 0: none
};

// Value at the window's centre of a plane fitted to the window's disparities, again without those
// that are outliers.
Sample fit_window(const CaptureInput& input, int cx, int cy, int radius) {
    const int x0 = std::max(0, cx - radius),
              x1 = std::min(static_cast<int>(input.width) - 1, cx + radius);
    const int y0 = std::max(0, cy - radius),
              y1 = std::min(static_cast<int>(input.height) - 1, cy + radius);
    Eigen::Vector3d plane = Eigen::Vector3d::Zero();
    double limit = std::numeric_limits<double>::infinity();
    int used = 0;
    for (int round = 0; round < PlaneFit::kFits; ++round) {
        Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
        Eigen::Vector3d right = Eigen::Vector3d::Zero();
        double squares = 0;
        used = 0;
        for (int y = y0; y <= y1; ++y)
            for (int x = x0; x <= x1; ++x) {
                const int16_t raw =
                    input.disparity[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)];
                if (raw <= 0) continue;
                const double d = raw / static_cast<double>(DEFREC_DISPARITY_ONE);
                const Eigen::Vector3d row(1, x - cx, y - cy);
                const double residual = d - plane.dot(row);
                if (round > 0 && std::abs(residual) > limit) continue;
                normal += row * row.transpose();
                right += row * d;
                squares += residual * residual;
                ++used;
            }
        if (used < PlaneFit::kMinPixels) return {};
        plane = normal.ldlt().solve(right);
        limit = round == 0 ? PlaneFit::kFirstOutlier
                           : std::max(PlaneFit::kMinOutlier,
                                      PlaneFit::kOutlier * std::sqrt(squares / used));
    }
    const double area = static_cast<double>(x1 - x0 + 1) * (y1 - y0 + 1);
    if (used < PlaneFit::kMinFit * area || plane[0] < PlaneFit::kMinDisparity) return {};
    return {plane[0] + input.camera.disparity_offset_px, std::hypot(plane[1], plane[2]),
            used / area};
}

// Slope of the disparity, px per px and px of disparity, of the steepest surface that counts.
double steepest_disparity(const CaptureInput& input, const std::vector<Sample>& samples) {
    std::vector<double> slopes;
    for (const Sample& sample : samples)
        if (sample.weight > 0) slopes.push_back(sample.slope / sample.disparity);
    const double steepest = TemplateSurface::kSteepest / input.camera.fx;
    if (slopes.empty()) return steepest;
    return std::max(steepest, TemplateSurface::kSteepestOfMedian * median(std::move(slopes)));
}

// Sets of neighbouring samples without a step between them.
struct Surfaces {
    std::vector<int> label;  // per sample: which set, -1 none
    std::vector<int> size;   // samples per set
};

Surfaces find_surfaces(const CaptureInput& input, const std::vector<Sample>& samples, int columns,
                       int rows) {
    Surfaces surfaces;
    std::vector<int>& label = surfaces.label;
    label.assign(samples.size(), -1);
    const double steepest = steepest_disparity(input, samples);
    const auto usable = [&](const Sample& sample) {
        return sample.weight > 0 && sample.slope < steepest * sample.disparity;
    };
    std::vector<int> stack;
    for (size_t seed = 0; seed < samples.size(); ++seed) {
        if (!usable(samples[seed]) || label[seed] >= 0) continue;
        const int set = static_cast<int>(surfaces.size.size());
        surfaces.size.push_back(0);
        stack.assign(1, static_cast<int>(seed));
        label[seed] = set;
        while (!stack.empty()) {
            const int index = stack.back();
            stack.pop_back();
            ++surfaces.size.back();
            const int x = index % columns, y = index / columns;
            const Sample& here = samples[static_cast<size_t>(index)];
            const double step = steepest * here.disparity * input.vertex_spacing_px;
            for (const auto& [nx, ny] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
                if (nx < 0 || ny < 0 || nx >= columns || ny >= rows) continue;
                const size_t other = static_cast<size_t>(ny * columns + nx);
                if (label[other] >= 0 || !usable(samples[other])) continue;
                if (std::abs(here.disparity - samples[other].disparity) > step) continue;
                label[other] = set;
                stack.push_back(static_cast<int>(other));
            }
        }
    }
    return surfaces;
}

// The samples of accepted surfaces, but for those next to a rejected one.
std::vector<Sample> samples_of(const std::vector<Sample>& samples, const Surfaces& surfaces,
                               const std::vector<char>& accepted, int columns, int rows) {
    constexpr int kMargin = TemplateSurface::kRejectedMargin;
    const auto belongs = [&](size_t i) {
        return surfaces.label[i] >= 0 && accepted[static_cast<size_t>(surfaces.label[i])];
    };
    std::vector<Sample> kept = samples;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const size_t index = static_cast<size_t>(y * columns + x);
            bool clear = belongs(index);
            for (int dy = -kMargin; dy <= kMargin && clear; ++dy)
                for (int dx = -kMargin; dx <= kMargin && clear; ++dx) {
                    if (x + dx < 0 || y + dy < 0 || x + dx >= columns || y + dy >= rows) continue;
                    const size_t other = static_cast<size_t>((y + dy) * columns + x + dx);
                    clear = surfaces.label[other] < 0 || belongs(other);
                }
            if (!clear) kept[index].weight = 0;
        }
    return kept;
}

// Calls visit(vertex, stencil, times) for each second difference of the grid: D_xx and D_yy at the
// vertex and twice D_xy below and to the right of it; a stencil is vertices with factors.
template <class Visit>
void for_each_bending(int columns, int rows, const Visit& visit) {
    using Stencil = std::initializer_list<std::pair<int, double>>;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const int i = y * columns + x;
            if (x > 0 && x + 1 < columns) visit(i, Stencil{{i - 1, 1}, {i, -2}, {i + 1, 1}}, 1);
            if (y > 0 && y + 1 < rows)
                visit(i, Stencil{{i - columns, 1}, {i, -2}, {i + columns, 1}}, 1);
            if (x + 1 < columns && y + 1 < rows)
                visit(i, Stencil{{i, 1}, {i + 1, -1}, {i + columns, -1}, {i + columns + 1, 1}}, 2);
        }
}

// Minimises sum weight (D - d)^2 + stiffness * (D_xx^2 + 2 D_xy^2 + D_yy^2) in units of the grid,
// and pull * D^2 where there is no sample. stiffness: per vertex.
std::vector<float> smooth_spline(const std::vector<Sample>& samples, int columns, int rows,
                                 const std::vector<double>& stiffness, double pull) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(samples.size() * 40);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(samples.size()));
    for (size_t i = 0; i < samples.size(); ++i) {
        entries.emplace_back(i, i, samples[i].weight > 0 ? samples[i].weight : pull);
        right[static_cast<Eigen::Index>(i)] = samples[i].weight * samples[i].disparity;
    }
    for_each_bending(columns, rows, [&](int at, auto stencil, double times) {
        for (const auto& [i, a] : stencil)
            for (const auto& [j, b] : stencil)
                if (i >= j)
                    entries.emplace_back(i, j, times * stiffness[static_cast<size_t>(at)] * a * b);
    });
    Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(samples.size()),
                                       static_cast<Eigen::Index>(samples.size()));
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver(matrix);
    const Eigen::VectorXd solution = solver.solve(right);
    return {solution.data(), solution.data() + solution.size()};
}

// Stiffness per vertex that lets a spline bend where a stiff one already does: the weights of a
// Lorentzian penalty (Black and Rangarajan 1996) of its second differences.
std::vector<double> relaxed_stiffness(const std::vector<float>& spline, int columns, int rows) {
    constexpr double kBend2 = TemplateSurface::kBend * TemplateSurface::kBend;
    std::vector<double> bending2(spline.size(), 0);
    for_each_bending(columns, rows, [&](int at, auto stencil, double times) {
        double difference = 0;
        for (const auto& [i, a] : stencil)
            difference += a * static_cast<double>(spline[static_cast<size_t>(i)]);
        bending2[static_cast<size_t>(at)] += times * difference * difference;
    });
    for (double& each : bending2) each = TemplateSurface::kStiffness / (1 + each / kBend2);
    return bending2;
}

// A stiff spline tells where the surface bends; there the next is softer. What that one leaves of
// the samples is added as another spline (twicing, Tukey 1977), so that relief is flattened less;
// where there is no sample, the one before goes on alone.
std::vector<float> fit_spline(std::vector<Sample> samples, int columns, int rows) {
    constexpr double kNoPull = 1e-9;
    const std::vector<double> stiff(samples.size(), TemplateSurface::kStiffness),
        stiffness =
            relaxed_stiffness(smooth_spline(samples, columns, rows, stiff, kNoPull), columns, rows);
    std::vector<float> spline = smooth_spline(samples, columns, rows, stiffness, kNoPull);
    for (size_t i = 0; i < samples.size(); ++i)
        samples[i].disparity -= static_cast<double>(spline[i]);
    const std::vector<float> rest =
        smooth_spline(samples, columns, rows, stiffness, TemplateSurface::kPull);
    std::transform(spline.begin(), spline.end(), rest.begin(), spline.begin(), std::plus<>());
    return spline;
}

// Distance in grid steps to the nearest sample with weight.
std::vector<float> distance_to_samples(const std::vector<Sample>& samples, int columns, int rows) {
    std::vector<float> distance(samples.size());
    for (size_t i = 0; i < samples.size(); ++i) distance[i] = samples[i].weight > 0 ? 0.f : 1e9f;
    spread_distance(distance, columns, rows);
    return distance;
}

// A piece of the surface.
struct Piece {
    std::vector<char> accepted;   // per set of samples: it is of the piece
    std::vector<Sample> samples;  // of the piece
    std::vector<float> spline;    // fitted to these
    std::vector<char> other;      // per set: tissue that shows that the piece does not go on there
};

// How far a set lies in front of a piece's spline, share of the disparity: the median over what of
// it lies near the piece, where the spline is no guess, or over all of it where nothing does.
struct Lead {
    double share = 0;
    bool is_near = false;
};

// The lead of each set.
std::vector<Lead> leads_over(const Piece& piece, const std::vector<Sample>& samples,
                             const Surfaces& surfaces, int columns, int rows) {
    const std::vector<float> distance = distance_to_samples(piece.samples, columns, rows);
    std::vector<std::vector<double>> all(surfaces.size.size()), near(all.size());
    for (size_t i = 0; i < samples.size(); ++i) {
        if (surfaces.label[i] < 0) continue;
        const auto set = static_cast<size_t>(surfaces.label[i]);
        const double share = samples[i].disparity / static_cast<double>(piece.spline[i]) - 1;
        all[set].push_back(share);
        if (distance[i] <= TemplatePieces::kNearSteps) near[set].push_back(share);
    }
    std::vector<Lead> leads;
    for (size_t set = 0; set < all.size(); ++set) {
        const bool is_near = near[set].size() >= TemplatePieces::kMinNear;
        leads.push_back({median(std::move(is_near ? near[set] : all[set])), is_near});
    }
    return leads;
}

// Per sample the set that is nearest to it in steps along the grid; -1: there are none. Holes in a
// set, such as highlights, are its own.
std::vector<int> nearest_sets(const Surfaces& surfaces, int columns, int rows) {
    std::vector<int> nearest = surfaces.label;
    std::vector<size_t> front, next;
    for (size_t i = 0; i < nearest.size(); ++i)
        if (nearest[i] >= 0) front.push_back(i);
    const auto c = static_cast<size_t>(columns);
    for (; !front.empty(); std::swap(front, next), next.clear())
        for (const size_t i : front) {
            const auto reach = [&](bool is_there, size_t other) {
                if (!is_there || nearest[other] >= 0) return;
                nearest[other] = nearest[i];
                next.push_back(other);
            };
            const size_t x = i % c, y = i / c;
            reach(x > 0, i - 1);
            reach(x + 1 < c, i + 1);
            reach(y > 0, i - c);
            reach(y + 1 < static_cast<size_t>(rows), i + c);
        }
    return nearest;
}

// Radius of the largest disc in each set, mm, that may reach beyond the image.
std::vector<double> disc_radii(const CaptureInput& input, const std::vector<Sample>& samples,
                               const Surfaces& surfaces, int columns, int rows) {
    std::vector<double> radii(surfaces.size.size(), 0);
    const std::vector<int> nearest = nearest_sets(surfaces, columns, rows);
    const auto is_inside = [&](size_t i) {
        const int x = static_cast<int>(i) % columns, y = static_cast<int>(i) / columns;
        const auto c = static_cast<size_t>(columns);
        const int set = nearest[i];
        return (x == 0 || nearest[i - 1] == set) && (x + 1 == columns || nearest[i + 1] == set) &&
               (y == 0 || nearest[i - c] == set) && (y + 1 == rows || nearest[i + c] == set);
    };
    std::vector<float> distance(samples.size());
    for (size_t i = 0; i < samples.size(); ++i) distance[i] = is_inside(i) ? 1e9f : 0.f;
    spread_distance(distance, columns, rows);
    for (size_t i = 0; i < samples.size(); ++i) {
        const int set = surfaces.label[i];
        if (distance[i] <= 0 || set < 0) continue;
        double& radius = radii[static_cast<size_t>(set)];
        radius = std::max(radius, static_cast<double>(distance[i]) * input.vertex_spacing_px *
                                      input.camera.baseline_mm / samples[i].disparity);
    }
    return radii;
}

// Per set: whether it is other tissue, seen behind the piece's continuation, which would hide it,
// or in front, and too wide for an instrument.
std::vector<char> find_other(const CaptureInput& input, const Piece& piece,
                             const std::vector<Sample>& samples, const Surfaces& surfaces,
                             int columns, int rows) {
    constexpr Ratio kMinShare = TemplatePieces::kMinOtherShare;
    constexpr double kStep = TemplatePieces::kStep;
    const std::vector<Lead> leads = leads_over(piece, samples, surfaces, columns, rows);
    const std::vector<double> radii = disc_radii(input, samples, surfaces, columns, rows);
    std::vector<char> other(surfaces.size.size(), 0);
    for (size_t set = 0; set < other.size(); ++set)
        other[set] = piece.accepted[set] == 0 &&
                     static_cast<uint64_t>(surfaces.size[set]) * kMinShare.denominator >=
                         samples.size() * kMinShare.numerator &&
                     (leads[set].share < -kStep ||
                      (leads[set].share > kStep && radii[set] > TemplatePieces::kTissueRadius));
    return other;
}

// Distance in grid steps to the nearest sample of the sets.
std::vector<float> distance_to_sets(const Surfaces& surfaces, const std::vector<char>& sets,
                                    int columns, int rows) {
    std::vector<float> distance(surfaces.label.size(), 1e9f);
    for (size_t i = 0; i < distance.size(); ++i)
        if (surfaces.label[i] >= 0 && sets[static_cast<size_t>(surfaces.label[i])]) distance[i] = 0;
    spread_distance(distance, columns, rows);
    return distance;
}

// The sets that continue a piece: what an instrument cuts in two is one tissue, what lies in front
// of its continuation is the instrument. seed: its largest set. taken: sets of earlier pieces; of
// the others it takes those that are nearer to it than to these.
Piece select_piece(const CaptureInput& input, const std::vector<Sample>& samples,
                   const Surfaces& surfaces, size_t seed, const std::vector<char>& taken,
                   int columns, int rows) {
    Piece piece;
    piece.accepted.assign(surfaces.size.size(), 0);
    piece.accepted[seed] = 1;
    std::vector<int> nearer(surfaces.size.size(), 0);
    const std::vector<float> to_taken = distance_to_sets(surfaces, taken, columns, rows),
                             to_seed = distance_to_sets(surfaces, piece.accepted, columns, rows);
    for (size_t i = 0; i < samples.size(); ++i)
        if (surfaces.label[i] >= 0)
            nearer[static_cast<size_t>(surfaces.label[i])] += to_seed[i] < to_taken[i] ? 1 : -1;
    bool changed = true;
    for (int round = 0; changed; ++round) {
        piece.samples = samples_of(samples, surfaces, piece.accepted, columns, rows);
        piece.spline = fit_spline(piece.samples, columns, rows);
        changed = false;
        if (round == TemplatePieces::kMaxRounds) break;
        const std::vector<Lead> leads = leads_over(piece, samples, surfaces, columns, rows);
        for (size_t set = 0; set < piece.accepted.size(); ++set) {
            const double behind =
                leads[set].is_near ? TemplatePieces::kStep : TemplatePieces::kBehind;
            if (piece.accepted[set] || taken[set] || nearer[set] < 0 ||
                surfaces.size[set] < TemplatePieces::kMinSet ||
                leads[set].share > TemplatePieces::kStep || leads[set].share < -behind)
                continue;
            piece.accepted[set] = 1;
            changed = true;
        }
    }
    piece.other = find_other(input, piece, samples, surfaces, columns, rows);
    return piece;
}

// The largest surface with what continues it, then the largest of the tissue that is no part of the
// pieces so far, and so on.
std::vector<Piece> select_pieces(const CaptureInput& input, const std::vector<Sample>& samples,
                                 const Surfaces& surfaces, int columns, int rows) {
    std::vector<Piece> pieces;
    std::vector<char> taken(surfaces.size.size(), 0), waiting(surfaces.size.size(), 1);
    const auto measured = [](const Piece& piece) {
        return static_cast<size_t>(
            std::count_if(piece.samples.begin(), piece.samples.end(),
                          [](const Sample& sample) { return sample.weight > 0; }));
    };
    while (pieces.size() < TemplatePieces::kMaxPieces) {
        size_t seed = waiting.size();
        for (size_t set = 0; set < waiting.size(); ++set)
            if (waiting[set] && !taken[set] &&
                (seed == waiting.size() || surfaces.size[set] > surfaces.size[seed]))
                seed = set;
        if (seed == waiting.size()) break;
        Piece piece = select_piece(input, samples, surfaces, seed, taken, columns, rows);
        if (pieces.empty()) waiting = piece.other;
        waiting[seed] = 0;
        if (!pieces.empty() &&
            static_cast<double>(measured(piece)) <
                TemplatePieces::kMinPieceShare * static_cast<double>(samples.size()))
            continue;
        for (size_t set = 0; set < taken.size(); ++set) taken[set] |= piece.accepted[set];
        pieces.push_back(std::move(piece));
    }
    return pieces;
}

// Tissue of the other pieces, and what shows that this one does not go on.
std::vector<char> sets_beside(const std::vector<Piece>& pieces, size_t piece) {
    std::vector<char> sets = pieces[piece].other;
    for (size_t other = 0; other < pieces.size(); ++other)
        for (size_t set = 0; set < sets.size(); ++set)
            if (other != piece) sets[set] |= pieces[other].accepted[set];
    return sets;
}

// Writes where a piece is: the first one everywhere, another where it is nearer than those before.
void put_on_grid(const CaptureInput& input, const Surfaces& surfaces,
                 const std::vector<Piece>& pieces, size_t index, SurfaceGrid& grid) {
    const Piece& piece = pieces[index];
    const size_t count = grid.vertex.size();
    double minimum = 1e9, maximum = 0;
    for (const Sample& sample : piece.samples)
        if (sample.weight > 0) {
            minimum = std::min(minimum, sample.disparity);
            maximum = std::max(maximum, sample.disparity);
        }
    std::vector<float> support = distance_to_samples(piece.samples, grid.columns, grid.rows);
    const std::vector<float> beside =
        distance_to_sets(surfaces, sets_beside(pieces, index), grid.columns, grid.rows);
    const double reach = TemplateSurface::kReach * input.width;
    if (index == 0) {
        grid.disparity = piece.spline;
        grid.support.assign(count, 0);
    }
    for (size_t i = 0; i < count; ++i) {
        const bool ends_here = beside[i] < support[i];
        support[i] *= static_cast<float>(grid.spacing);
        const bool is_covered = support[i] <= reach && !ends_here &&
                                (index == 0 || grid.vertex[i] < 0 || support[i] < grid.support[i]);
        if (index > 0 && !is_covered) continue;
        grid.support[i] = support[i];
        // The spline's continuation beyond its data must stay a plausible depth.
        grid.disparity[i] = std::clamp(
            piece.spline[i], static_cast<float>(TemplateSurface::kMinDisparity * minimum),
            static_cast<float>(TemplateSurface::kMaxDisparity * maximum));
        if (!is_covered) continue;
        grid.vertex[i] = 0;
        if (index > 0) grid.piece[i] = static_cast<uint8_t>(index);
    }
}

}  // namespace

std::optional<double> measured_disparity(const CaptureInput& input, double u, double v,
                                         int radius) {
    const Sample sample = fit_window(input, static_cast<int>(std::lround(u)),
                                     static_cast<int>(std::lround(v)), radius);
    if (sample.weight == 0) return std::nullopt;
    return sample.disparity;
}

size_t fit_surface(const CaptureInput& input, SurfaceGrid& grid) {
    grid.spacing = input.vertex_spacing_px;
    // The last column and row lie on the image's rim or just beyond it, so that every pixel has
    // vertices round it.
    grid.columns = static_cast<int>(std::ceil((input.width - 1) / grid.spacing)) + 1;
    grid.rows = static_cast<int>(std::ceil((input.height - 1) / grid.spacing)) + 1;
    const size_t count = static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows);

    std::vector<Sample> samples(count);
    const int radius = std::max(PlaneFit::kMinRadius,
                                static_cast<int>(std::lround(grid.spacing * PlaneFit::kRadius)));
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x)
            samples[static_cast<size_t>(y * grid.columns + x)] =
                fit_window(input, static_cast<int>(std::lround(x * grid.spacing)),
                           static_cast<int>(std::lround(y * grid.spacing)), radius);
    const Surfaces surfaces = find_surfaces(input, samples, grid.columns, grid.rows);
    const std::vector<Piece> pieces =
        select_pieces(input, samples, surfaces, grid.columns, grid.rows);
    size_t measured = 0;
    for (const Piece& piece : pieces)
        for (const Sample& sample : piece.samples) measured += sample.weight > 0;
    if (static_cast<double>(measured) < TemplateSurface::kMinCoverage * static_cast<double>(count))
        return 0;

    grid.vertex.assign(count, -1);
    grid.piece.assign(pieces.size() > 1 ? count : 0, 0);
    for (size_t index = 0; index < pieces.size(); ++index)
        put_on_grid(input, surfaces, pieces, index, grid);
    return pieces.size();
}

}  // namespace defrec
