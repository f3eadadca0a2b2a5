// Prints how stage lm of the CPU backend converges, control points solved together against each by
// itself: the tables of docs/experiments/2026-11-21-lm-convergence.md. Usage: defrec_lm_convergence
#include <cstdio>
#include <ctime>

#include "backends/cpu/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "backends/shared/test_surface.hpp"
#include "sdk/contract/stage_params.hpp"

namespace {

using namespace defrec;
using namespace defrec::test;
using Point = Vec3<double>;

constexpr int kRuns = 15;  // the fastest counts

double thread_milliseconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * double(now.tv_sec) + 1e-6 * double(now.tv_nsec);
}

template <class T>
InBuffer in(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

SurfaceSpec full_size(double connection) {
    SurfaceSpec spec;
    spec.width = 960;
    spec.height = 540;
    spec.focal = 1000;
    spec.node_step = 40;
    spec.point_step = 8;
    spec.landmarks = 300;
    spec.patches = 800;
    spec.connection = connection;
    return spec;
}

// Noise as the other stages leave it: 0.15 px of disparity over 8x8 px, 0.1 mm across and 0.2 mm
// along in matches, 0.15 px in patches.
void add_noise(TestSurface& surface) {
    std::mt19937 random(3);
    std::normal_distribution<double> some(0, 1);
    const auto width = size_t(surface.width()), cells = width / 8 + 1;
    std::vector<double> cell((size_t(surface.height()) / 8 + 1) * cells);
    for (double& value : cell) value = 16 * 0.15 * some(random);
    for (size_t i = 0; i < surface.disparity.size(); ++i)
        if (surface.disparity[i] > 0)
            surface.disparity[i] = int16_t(
                surface.disparity[i] + std::lround(cell[i / width / 8 * cells + i % width / 8]));
    for (auto& match : surface.matches) {
        if (match.weight == 0) continue;
        const Point ray = (1 / double(match.position[2])) * load3<double>(match.position);
        store3(load3<double>(match.position) + 0.2 * some(random) * ray +
                   Point{0.1 * some(random), 0.1 * some(random), 0},
               match.position);
    }
    for (auto& seen : surface.observations) {
        seen.u += int32_t(256 * 0.15 * some(random));
        seen.v += int32_t(256 * 0.15 * some(random));
    }
}

struct Outcome {
    double visible, hidden, cost, milliseconds;  // errors: 95th percentile, mm
    int iterations;
};

double percentile95(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[size_t(0.95 * double(values.size() - 1))];
}

Outcome solve(const TestSurface& surface, defrec_lm_params params, const Deformation& truth,
              const std::function<bool(double, double)>& hidden) {
    fill_defaults(params);
    const TestHost host(1);
    const auto stage = cpu::make_lm(params, host.host());
    const InBuffer prepared[] = {in(surface.nodes), in(surface.edges), in(surface.points),
                                 in(surface.landmarks), in(surface.patches)};
    stage->prepare(prepared);
    const auto start = surface.rest();
    std::vector<defrec_motion> motions(start.size());
    defrec_lm_summary summary{};
    const InBuffer given[] = {in(start), in(surface.matches), in(surface.observations),
                              in(surface.disparity)};
    const OutBuffer results[] = {{motions.data(), motions.size() * sizeof(motions[0])},
                                 {&summary, sizeof summary}};
    double best = 1e9;
    for (int run = 0; run < kRuns; ++run) {
        const double before = thread_milliseconds();
        stage->run(given, results);
        best = std::min(best, thread_milliseconds() - before);
    }
    std::vector<double> seen, unseen;
    for (const auto& point : surface.points) {
        const Point expected = truth(load3<double>(point.position)),
                    off = TestSurface::moved(motions, point) - expected;
        const auto pixel = surface.project(expected);
        if (pixel.u < 0 || pixel.v < 0 || pixel.u > surface.width() - 1 ||
            pixel.v > surface.height() - 1)
            continue;
        (hidden(pixel.u, pixel.v) ? unseen : seen).push_back(std::sqrt(dot(off, off)));
    }
    return {percentile95(seen), percentile95(unseen), double(summary.final_cost), best,
            summary.iterations};
}

// Half of the surface hidden, all of it moved by 10 mm: how soon the hidden half follows.
void occluded_half() {
    const Deformation truth = [](Point p) { return Point{p.x + 7, p.y + 7, p.z + 1.5}; };
    const auto hidden = [](double u, double) { return u < 480; };
    std::printf(
        "\nHalf hidden, moved by 10 mm; error of the hidden half, 95th percentile in mm "
        "(milliseconds)\n\n"
        "| connections | solver | 1 iteration | 3 | 5 | 10 | 20 | 50 "
        "|\n|---|---|---|---|---|---|---|---|\n");
    for (const double connection : {1.5, 2.5, 4.0})
        for (const uint32_t solver :
             {uint32_t(DEFREC_SOLVER_INDEPENDENT), uint32_t(DEFREC_SOLVER_COUPLED)}) {
            TestSurface surface(full_size(connection));
            surface.deform(truth);
            surface.hide(hidden);
            add_noise(surface);
            defrec_lm_params params = surface.lm_params();
            params.solver = solver;
            params.match_tukey_mm =
                50;  // the start is far: no kernel is to cut off what moves the surface
            params.patch_tukey_px = 600;
            std::printf("| %.0f a control point | %s |",
                        2.0 * double(surface.edges.size()) / (double(surface.nodes.size()) / 3),
                        solver == DEFREC_SOLVER_COUPLED ? "coupled" : "independent");
            for (const uint32_t iterations : {1u, 3u, 5u, 10u, 20u, 50u}) {
                params.iterations = iterations;
                const Outcome outcome = solve(surface, params, truth, hidden);
                std::printf(" %.2f (%.1f) |", outcome.hidden, outcome.milliseconds);
            }
            std::printf("\n");
        }
}

Point wave(Point p) {
    return {p.x + 1.5 * std::sin(p.y / 8) + 0.5, p.y + std::cos(p.x / 9),
            p.z + 3 * std::sin(p.x / 7 + p.y / 9)};
}

// All of it visible and deformed.
void visible_wave() {
    TestSurface surface(full_size(2.5));
    surface.deform(wave);
    add_noise(surface);
    std::printf(
        "\nA wave of 3 mm, all visible; error, 95th percentile in mm / cost in mm^2 "
        "(milliseconds)\n\n"
        "| solver | 1 iteration | 2 | 3 | 4 | 8 | 20 |\n|---|---|---|---|---|---|---|\n");
    struct Variant {
        const char* name;
        uint32_t solver, steps;
    };
    for (const Variant& variant : {Variant{"independent", DEFREC_SOLVER_INDEPENDENT, 0},
                                   Variant{"coupled, 5 steps", DEFREC_SOLVER_COUPLED, 5},
                                   Variant{"coupled, 10 steps", DEFREC_SOLVER_COUPLED, 10},
                                   Variant{"coupled, 20 steps", DEFREC_SOLVER_COUPLED, 20},
                                   Variant{"coupled, 60 steps", DEFREC_SOLVER_COUPLED, 60}}) {
        defrec_lm_params params = surface.lm_params();
        params.solver = variant.solver;
        params.cg_iterations = variant.steps;
        std::printf("| %s |", variant.name);
        for (const uint32_t iterations : {1u, 2u, 3u, 4u, 8u, 20u}) {
            params.iterations = iterations;
            const Outcome outcome =
                solve(surface, params, wave, [](double, double) { return false; });
            std::printf(" %.3f / %.0f (%.1f) |", outcome.visible, outcome.cost,
                        outcome.milliseconds);
        }
        std::printf("\n");
    }
}

}  // namespace

int main() {
    const TestSurface surface(full_size(2.5));
    std::printf("%zu control points, %zu points, %zu matches, %zu patches\n",
                surface.nodes.size() / 3, surface.points.size(), surface.landmarks.size(),
                surface.patches.size());
    occluded_half();
    visible_wave();
}
