// Stage lm: kernels for the rigid motion before, for the residuals and for each step.
// docs/stages/lm.md.
#include <optional>

#include "backends/cuda/lm_evaluate.cuh"
#include "backends/cuda/lm_gradients.cuh"
#include "backends/cuda/lm_presolve.cuh"
#include "backends/cuda/stages.hpp"
#include "backends/shared/plain_host.hpp"

namespace defrec::cuda {
namespace {

// What evaluates residuals: many blocks, all of which run at once.
struct Evaluation {
    void (*begin)(LmView);
    void (*step)(LmView, uint32_t);
    uint32_t blocks;
    size_t shared, local;  // of a block: bytes of shared memory, floats beside
};

// What solves the system: few blocks.
struct Solver {
    void (*kernel)(LmView, uint32_t);
    bool cluster;
    uint32_t blocks;
    size_t shared, local;
};

constexpr uint64_t kMaxItems = 1u << 24;  // counted in single precision
constexpr uint32_t kMaxIterations = 1024;

template <class T>
std::vector<T> part_of(const std::vector<T>& values, size_t first, size_t count) {
    return {values.begin() + std::ptrdiff_t(first), values.begin() + std::ptrdiff_t(first + count)};
}

// The template on the device, and everything that a run writes.
struct Surface {
    Evaluation evaluation;
    Solver solver;
    LmSurface sizes;  // without the lists
    LmRows row_sizes;
    Buffer rest, landmarks, landmark_nodes;
    Buffer shares, known, row_places, items, item_nodes, item_vectors, connections, chunks, sums,
        terms;
    Buffer row_shares, row_known, places;
    Buffer poses, diagonals, matrix, block_sums, scales, steps, states;
    Buffer data, data_sums, factors, starts, products, dots, local, row_local, passed, row_passed,
        finite;
    Buffer deformed, rigid;

    Surface(Device& device, const Evaluation& evaluates, const Solver& solves, const LmLists& lists,
            const LmPlan& plan, const LmRowPlan& rows, const defrec_lm_params& p)
        : evaluation(evaluates),
          solver(solves),
          sizes{},
          row_sizes{},
          rest(upload(device, lists.rest)),
          landmarks(upload(device, part_of(lists.items, LmLists::kItemVectors * p.points,
                                           LmLists::kItemVectors * p.landmarks))),
          landmark_nodes(upload(device, part_of(lists.item_nodes, p.points, p.landmarks))),
          shares(upload(device, plan.shares)),
          known(upload(device, plan.known)),
          row_places(upload(device, plan.row_places)),
          items(upload(device, plan.items)),
          item_nodes(upload(device, plan.item_nodes)),
          item_vectors(upload(device, plan.item_vectors)),
          connections(upload(device, plan.connections)),
          chunks(upload(device, plan.chunks)),
          sums(upload(device, plan.sums)),
          terms(upload(device, plan.terms)),
          row_shares(upload(device, rows.shares)),
          row_known(upload(device, rows.known)),
          places(upload(device, rows.places)),
          poses(make_buffer<float4>(device, uint64_t{2 * 2} * p.nodes)),
          diagonals(make_buffer<float>(device, uint64_t{2 * kDiagonal} * p.nodes)),
          matrix(make_buffer<float>(device, 2 * 36 * plan.places.size())),
          block_sums(make_buffer<float>(device, kSums * evaluates.blocks)),
          scales(make_buffer<float>(device, plan.connections.size())),
          steps(make_buffer<float>(device, uint64_t{6} * p.nodes)),
          states(make_buffer<LmState>(device, 2)),
          data(make_buffer<float>(device, p.nodes)),
          data_sums(make_buffer<float2>(device, evaluates.blocks)),
          factors(make_buffer<float>(device, uint64_t{kFactorRoom} * p.nodes)),
          starts(make_buffer<float>(device, uint64_t{6} * p.nodes)),
          products(make_buffer<float>(device, uint64_t{2 * 6} * p.nodes)),
          dots(make_buffer<float4>(device, uint64_t{2} * solves.blocks)),
          local(make_buffer<float>(device, evaluates.local * evaluates.blocks)),
          row_local(make_buffer<float>(device, solves.local * solves.blocks)),
          passed(upload(device, std::vector<uint32_t>(evaluates.blocks))),
          row_passed(upload(device, std::vector<uint32_t>(solves.blocks))),
          finite(make_buffer<uint32_t>(device, solves.blocks)),
          deformed(make_buffer<float4>(device, p.landmarks)),
          rigid(make_buffer<float4>(device, 2)) {
        sizes.blocks = evaluates.blocks;
        sizes.places = uint32_t(plan.places.size());
        sizes.rows = plan.rows;
        sizes.max_known = plan.max_known;
        sizes.max_places = plan.max_places;
        sizes.max_items = plan.max_items;
        sizes.max_connections = plan.max_connections;
        sizes.max_terms = plan.max_terms;
        row_sizes.rows = rows.rows;
        row_sizes.max_known = rows.max_known;
        row_sizes.max_places = rows.max_places;
    }

    LmSurface view() const {
        LmSurface v = sizes;
        v.rest = rest.as<float4>();
        v.shares = shares.as<LmShare>();
        v.known = known.as<uint32_t>();
        v.items = items.as<uint32_t>();
        v.item_nodes = item_nodes.as<uint4>();
        v.item_vectors = item_vectors.as<float4>();
        v.connections = connections.as<LmConnection>();
        v.chunks = chunks.as<LmChunk>();
        v.sums = sums.as<LmSum>();
        v.terms = terms.as<uint16_t>();
        return v;
    }
    LmRows rows() const {
        LmRows v = row_sizes;
        v.shares = row_shares.as<LmRowShare>();
        v.known = row_known.as<uint32_t>();
        v.places = places.as<LmPlace>();
        v.row_places = row_places.as<uint32_t>();
        return v;
    }
    LmExchange exchange() const {
        return {.poses = poses.as<float4>(),
                .diagonals = diagonals.as<float>(),
                .matrix = matrix.as<float>(),
                .sums = block_sums.as<float>(),
                .scales = scales.as<float>(),
                .steps = steps.as<float>(),
                .states = states.as<LmState>(),
                .data = data.as<float>(),
                .data_sums = data_sums.as<float2>(),
                .factors = factors.as<float>(),
                .starts = starts.as<float>(),
                .products = products.as<float>(),
                .dots = dots.as<float4>(),
                .local = local.as<float>(),
                .row_local = row_local.as<float>(),
                .local_floats = evaluation.local,
                .row_local_floats = solver.local,
                .passed = passed.as<uint32_t>(),
                .row_passed = row_passed.as<uint32_t>(),
                .finite = finite.as<uint32_t>()};
    }
};

class Lm final : public Stage {
  public:
    Lm(const defrec_lm_params& params, Device& device) : p_(params), device_(device) {
        if (params.iterations > kMaxIterations)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "lm: at most " + std::to_string(kMaxIterations) + " iterations");
    }

    void prepare(std::span<const InBuffer> in) override {
        const Host host(&plain_host());
        LmTemplate surface(host);
        surface.read(p_, in);
        if (uint64_t{p_.points} + p_.landmarks + p_.patches > kMaxItems)
            throw StageError(
                DEFREC_ERROR_UNSUPPORTED,
                "lm: more than " + std::to_string(kMaxItems) + " points, landmarks and patches");
        const LmLists lists(p_, surface);
        const PlannedSolver planned = choose_solver(surface);
        if (!choose<true>(surface, lists, planned) && !choose<false>(surface, lists, planned))
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "lm: the device holds no block of the solver");
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        if (!surface_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const auto buffers = view_buffers<LmBuffers>(p_, in, out);
        const Surface& s = *surface_;
        const bool presolve = p_.presolve != 0 && buffers.matches != nullptr;
        if (presolve) {
            const LmPresolve task{s.landmarks.as<float4>(),
                                  s.landmark_nodes.as<int4>(),
                                  p_.landmarks,
                                  p_.match_tukey_mm,
                                  buffers.motions,
                                  buffers.matches,
                                  s.deformed.as<float4>(),
                                  s.rigid.as<float4>()};
            recorder.early({range_of(buffers.motions, p_.nodes)}, [&] {
                recorder.launch(lm_deform,
                                {dim3(cover(p_.landmarks, kDeformThreads)), dim3(kDeformThreads)},
                                task);
            });
            recorder.launch(lm_presolve, {dim3(1), dim3(kPresolveThreads)}, task);
        }
        const LmFrameView given{buffers.motions, buffers.matches, buffers.observations,
                                presolve ? s.rigid.as<float4>() : nullptr};
        const LmView view{parameters(disparity_image(p_, buffers.disparity)),
                          s.view(),
                          s.rows(),
                          given,
                          s.exchange(),
                          buffers.results,
                          buffers.summary};
        const Grid evaluates{dim3(s.evaluation.blocks), dim3(kLmThreads), s.evaluation.shared};
        Grid begins = evaluates, solves{dim3(s.solver.blocks), dim3(kRowThreads), s.solver.shared};
        begins.cooperative = true;
        solves.cooperative = !s.solver.cluster;
        solves.cluster = s.solver.cluster;
        recorder.launch(s.evaluation.begin, begins, view);
        for (uint32_t i = 0; i < p_.iterations; ++i) {
            recorder.launch(s.solver.kernel, solves, view, i);
            if (view.p.trusts_last_step && i + 1 == p_.iterations) return;
            recorder.launch(s.evaluation.step, evaluates, view, i);
        }
        recorder.launch(lm_finish,
                        {dim3(std::max(cover(p_.nodes, kLmThreads), 1u)), dim3(kLmThreads)}, view);
    }

  private:
    LmParameters parameters(const DisparityImage& image) const {
        return {constants_of(p_), p_.camera,          image,
                p_.iterations,    gradient_steps(p_), p_.trust_last_step != 0};
    }
    struct PlannedSolver {
        Solver solver;
        LmRowPlan rows;
    };
    // The first that the device holds.
    PlannedSolver choose_solver(const LmTemplate& surface) const {
        std::optional<LmRowPlan> rows;
        const auto fits = [&](Solver& solver, uint32_t blocks) {
            rows.emplace(surface.pattern, uint32_t(surface.nodes.size()), blocks);
            const size_t floats = lm_row_floats(*rows);
            const bool shares = solver.kernel != &lm_gradients<GridBarrier, false>;
            solver.blocks = uint32_t(rows->shares.size());
            solver.shared = shares ? sizeof(float) * floats : 0;
            solver.local = shares ? 0 : floats;
            const auto* function = reinterpret_cast<const void*>(solver.kernel);
            if (solver.shared > device_.limits().shared_per_block) return false;
            return solver.cluster
                       ? device_.holds_cluster(function, solver.blocks, kRowThreads, solver.shared)
                       : device_.resident_blocks(function, kRowThreads, solver.shared) >=
                             solver.blocks;
        };
        Solver solver{lm_gradients<ClusterBarrier, true>, true, 0, 0, 0};
        if (fits(solver, kMaxRowBlocks)) return {solver, *std::move(rows)};
        solver = {lm_gradients<GridBarrier, true>, false, 0, 0, 0};
        const uint32_t most = device_.limits().multiprocessors;
        for (uint32_t blocks = std::min(kMaxRowBlocks, most);;
             blocks = std::min(2 * blocks, most)) {
            if (fits(solver, blocks)) return {solver, *std::move(rows)};
            if (blocks == most) break;
        }
        solver.kernel = lm_gradients<GridBarrier, false>;
        fits(solver, std::min(kMaxRowBlocks, most));
        return {solver, *std::move(rows)};
    }
    // False where shared memory does not hold that. One block for each multiprocessor: more would
    // only make barriers longer.
    template <bool kShared>
    bool choose(const LmTemplate& surface, const LmLists& lists, const PlannedSolver& planned) {
        for (uint32_t maximum = device_.limits().multiprocessors; maximum > 0;) {
            const LmPlan plan(surface, lists, maximum);
            const size_t local = lm_local_floats(plan);
            const Evaluation evaluation{
                lm_begin<kShared>, lm_step<kShared>, static_cast<uint32_t>(plan.shares.size()),
                sizeof(float) * (lm_chunk_floats(plan) + (kShared ? local : 0)),
                kShared ? 0 : local};
            if (evaluation.shared > device_.limits().shared_per_block) return false;
            maximum = device_.resident_blocks(reinterpret_cast<const void*>(evaluation.begin),
                                              kLmThreads, evaluation.shared);
            if (maximum < evaluation.blocks) continue;
            surface_ = std::make_unique<Surface>(device_, evaluation, planned.solver, lists, plan,
                                                 planned.rows, p_);
            return true;
        }
        return false;
    }

    defrec_lm_params p_;
    Device& device_;
    std::unique_ptr<Surface> surface_;
};

}  // namespace

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Lm>(params, device);
}

}  // namespace defrec::cuda
