// Stage lm: a kernel for the rigid motion before, one for all the rest. docs/stages/lm.md.
#include "backends/cuda/lm_presolve.cuh"
#include "backends/cuda/lm_solve.cuh"
#include "backends/cuda/stages.hpp"
#include "backends/shared/plain_host.hpp"

namespace defrec::cuda {
namespace {

using Kernel = void (*)(LmView);

struct Solver {
    Kernel kernel;
    uint32_t blocks;
    size_t shared, local;  // of a block: bytes of shared memory, floats beside
};

constexpr uint64_t kMaxItems = 1u << 24;  // counted in single precision

template <class T>
std::vector<T> part_of(const std::vector<T>& values, size_t first, size_t count) {
    return {values.begin() + std::ptrdiff_t(first), values.begin() + std::ptrdiff_t(first + count)};
}

// The template on the device, and everything that a run writes.
struct Surface {
    Solver solver;
    uint32_t rows, max_known, max_places, max_sums;
    Buffer rest, landmarks, landmark_nodes;
    Buffer shares, known, places, row_places, items, item_nodes, item_vectors, connections, chunks,
        sums, terms;
    Buffer data, data_sums, scales, factors, starts, products, dots, block_sums, local, passed,
        deformed, rigid;

    Surface(Device& device, const Solver& chosen, const LmLists& lists, const LmPlan& plan,
            const defrec_lm_params& p)
        : solver(chosen),
          rows(plan.rows),
          max_known(plan.max_known),
          max_places(plan.max_places),
          max_sums(plan.max_sums),
          rest(upload(device, lists.rest)),
          landmarks(upload(device, part_of(lists.items, LmLists::kItemVectors * p.points,
                                           LmLists::kItemVectors * p.landmarks))),
          landmark_nodes(upload(device, part_of(lists.item_nodes, p.points, p.landmarks))),
          shares(upload(device, plan.shares)),
          known(upload(device, plan.known)),
          places(upload(device, plan.places)),
          row_places(upload(device, plan.row_places)),
          items(upload(device, plan.items)),
          item_nodes(upload(device, plan.item_nodes)),
          item_vectors(upload(device, plan.item_vectors)),
          connections(upload(device, plan.connections)),
          chunks(upload(device, plan.chunks)),
          sums(upload(device, plan.sums)),
          terms(upload(device, plan.terms)),
          data(make_buffer<float>(device, p.nodes)),
          data_sums(make_buffer<float2>(device, chosen.blocks)),
          scales(make_buffer<float>(device, plan.connections.size())),
          factors(make_buffer<float>(device, uint64_t{2 * kFactor} * p.nodes)),
          starts(make_buffer<float>(device, uint64_t{2 * 6} * p.nodes)),
          products(make_buffer<float>(device, uint64_t{2 * 6} * p.nodes)),
          dots(make_buffer<float4>(device, uint64_t{2} * chosen.blocks)),
          block_sums(make_buffer<float>(device, uint64_t{2 * kSums} * chosen.blocks)),
          local(make_buffer<float>(device, chosen.local * chosen.blocks)),
          passed(upload(device, std::vector<uint32_t>(chosen.blocks))),
          deformed(make_buffer<float4>(device, p.landmarks)),
          rigid(make_buffer<float4>(device, 2)) {}

    LmSurface view() const {
        return {rest.as<float4>(),
                shares.as<LmShare>(),
                known.as<uint32_t>(),
                places.as<LmPlace>(),
                row_places.as<uint32_t>(),
                items.as<uint32_t>(),
                item_nodes.as<uint4>(),
                item_vectors.as<float4>(),
                connections.as<LmConnection>(),
                chunks.as<LmChunk>(),
                sums.as<LmSum>(),
                terms.as<uint16_t>(),
                rows,
                max_known,
                max_places,
                max_sums};
    }
    LmExchange exchange() const {
        return {
            data.as<float>(),   data_sums.as<float2>(), scales.as<float>(), factors.as<float>(),
            starts.as<float>(), products.as<float>(),   dots.as<float4>(),  block_sums.as<float>(),
            local.as<float>(),  passed.as<uint32_t>(),  solver.local};
    }
};

class Lm final : public Stage {
  public:
    Lm(const defrec_lm_params& params, Device& device) : p_(params), device_(device) {}

    void prepare(std::span<const InBuffer> in) override {
        const Host host(&plain_host());
        LmTemplate surface(host);
        surface.read(p_, in);
        if (uint64_t{p_.points} + p_.landmarks + p_.patches > kMaxItems)
            throw StageError(
                DEFREC_ERROR_UNSUPPORTED,
                "lm: more than " + std::to_string(kMaxItems) + " points, landmarks and patches");
        const LmLists lists(p_, surface);
        if (!choose<true>(surface, lists) && !choose<false>(surface, lists))
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "lm: the device holds no block of the solver");
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        if (!surface_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const auto buffers = view_buffers<LmBuffers>(p_, in, out);
        const Surface& s = *surface_;
        const LmSurface surface = s.view();
        const bool presolve = p_.presolve != 0 && buffers.matches != nullptr;
        if (presolve)
            recorder.launch(
                lm_presolve, {dim3(1), dim3(kPresolveThreads)},
                LmPresolve{s.landmarks.as<float4>(), s.landmark_nodes.as<int4>(), p_.landmarks,
                           p_.match_tukey_mm, buffers.motions, buffers.matches,
                           s.deformed.as<float4>(), s.rigid.as<float4>()});
        const LmFrameView given{buffers.motions, buffers.matches, buffers.observations,
                                presolve ? s.rigid.as<float4>() : nullptr};
        recorder.launch(s.solver.kernel,
                        {dim3(s.solver.blocks), dim3(kLmThreads), s.solver.shared, true},
                        LmView{parameters(disparity_image(p_, buffers.disparity)), surface, given,
                               s.exchange(), buffers.results, buffers.summary});
    }

  private:
    LmParameters parameters(const DisparityImage& image) const {
        return {constants_of(p_), p_.camera, image, p_.iterations, gradient_steps(p_)};
    }
    // False where shared memory does not hold that. One block for each multiprocessor: more would
    // only make barriers longer.
    template <bool kShared>
    bool choose(const LmTemplate& surface, const LmLists& lists) {
        for (uint32_t maximum = device_.limits().multiprocessors; maximum > 0;) {
            const LmPlan plan(surface, lists, maximum);
            const size_t local = lm_local_floats(plan);
            const Solver solver{lm_solve<kShared>, static_cast<uint32_t>(plan.shares.size()),
                                sizeof(float) * (kLmChunkFloats + (kShared ? local : 0)),
                                kShared ? 0 : local};
            if (solver.shared > device_.limits().shared_per_block) return false;
            maximum = device_.resident_blocks(reinterpret_cast<const void*>(solver.kernel),
                                              kLmThreads, solver.shared);
            if (maximum < solver.blocks) continue;
            surface_ = std::make_unique<Surface>(device_, solver, lists, plan, p_);
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
    return std::make_unique<Lm>(params, device);
}

}  // namespace defrec::cuda
