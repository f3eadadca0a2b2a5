// Stage lm: a kernel for the rigid motion before, one for all the rest. docs/stages/lm.md.
#include "backends/cuda/lm_presolve.cuh"
#include "backends/cuda/lm_solve.cuh"
#include "backends/cuda/stages.hpp"
#include "backends/shared/plain_host.hpp"

namespace defrec::cuda {
namespace {

using Kernel = void (*)(LmView);

// What the solver keeps in shared memory, and how many blocks it has.
struct Shape {
    Kernel kernel = nullptr;
    uint32_t blocks = 0;
    size_t shared = 0;
    bool replicated = false, matrix = false;
};

constexpr uint64_t kMostItems = 1u << 24;  // counted in single precision

// The template on the device, and everything that a run writes.
struct Surface {
    Shape shape;
    uint32_t rows, most_places;
    Buffer rest, items, item_nodes, shares, places, row_places, block_items, connections, chunks, sums, terms;
    Buffer data, scales, factors, starts, products, block_sums, matrix, vectors, poses, present, own, own_factors;
    Buffer deformed, rigid;

    Surface(Device& device, const Shape& solver, const LmLists& lists, const LmPlan& plan, const defrec_lm_params& p)
        : shape(solver),
          rows(plan.rows),
          most_places(plan.most_places),
          rest(upload(device, lists.rest)),
          items(upload(device, lists.items)),
          item_nodes(upload(device, lists.item_nodes)),
          shares(upload(device, plan.shares)),
          places(upload(device, plan.places)),
          row_places(upload(device, plan.row_places)),
          block_items(upload(device, plan.items)),
          connections(upload(device, plan.connections)),
          chunks(upload(device, plan.chunks)),
          sums(upload(device, plan.sums)),
          terms(upload(device, plan.terms)),
          data(make_buffer<float>(device, p.nodes)),
          scales(make_buffer<float>(device, plan.connections.size())),
          factors(make_buffer<float>(device, uint64_t{2 * kFactor} * p.nodes)),
          starts(make_buffer<float>(device, uint64_t{2 * 6} * p.nodes)),
          products(make_buffer<float>(device, uint64_t{2 * 6} * p.nodes)),
          block_sums(make_buffer<float>(device, uint64_t{2 * kSums} * solver.blocks)),
          matrix(make_buffer<float>(device, solver.matrix ? 0 : 36 * uint64_t{plan.places.size()})),
          vectors(make_buffer<float>(device, solver.replicated ? 0 : uint64_t{3 * 6} * p.nodes)),
          poses(make_buffer<float4>(device, solver.replicated ? 0 : uint64_t{kPose} * p.nodes)),
          present(make_buffer<float4>(device, solver.replicated ? 0 : uint64_t{kPresent} * p.nodes)),
          own(make_buffer<float>(device, solver.replicated ? 0 : uint64_t{kOwn} * p.nodes)),
          own_factors(make_buffer<float>(device, solver.replicated ? 0 : uint64_t{kOwnFactor} * p.nodes)),
          deformed(make_buffer<float4>(device, p.landmarks)),
          rigid(make_buffer<float4>(device, 2)) {}

    LmSurface view() const {
        return {rest.as<float4>(),          items.as<float4>(),         item_nodes.as<int4>(),      shares.as<LmShare>(),
                places.as<LmPlace>(),       row_places.as<uint32_t>(),  block_items.as<uint32_t>(), connections.as<LmConnection>(),
                chunks.as<uint32_t>(),      sums.as<LmSum>(),           terms.as<uint32_t>(),       rows,
                most_places};
    }
    LmExchange exchange() const {
        return {data.as<float>(),   scales.as<float>(), factors.as<float>(), starts.as<float>(),  products.as<float>(), block_sums.as<float>(),
                matrix.as<float>(), vectors.as<float>(), poses.as<float4>(), present.as<float4>(), own.as<float>(),
                own_factors.as<float>()};
    }
};

class Lm final : public Stage {
  public:
    Lm(const defrec_lm_params& params, Device& device) : p_(params), device_(device) {}

    void prepare(std::span<const InBuffer> in) override {
        surface_.reset();
        const Host host(&plain_host());
        LmTemplate surface(host);
        surface.read(p_, in);
        if (uint64_t{p_.points} + p_.landmarks + p_.patches > kMostItems)
            throw StageError(DEFREC_ERROR_UNSUPPORTED, "lm: more than " + std::to_string(kMostItems) + " points, landmarks and patches");
        const LmLists lists(p_, surface);
        if (!choose<LmMode<true, true>>(surface, lists) && !choose<LmMode<true, false>>(surface, lists) &&
            !choose<LmMode<false, false>>(surface, lists))
            throw StageError(DEFREC_ERROR_UNSUPPORTED, "lm: the device holds no block of the solver");
    }

    void record(Recorder& recorder, std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!surface_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const LmFrame frame = LmFrame::read(p_, in);
        expect_buffers("lm out", out, 2);
        auto* motions = take<defrec_motion>("lm motions", out[0], p_.nodes);
        auto* summary = take<defrec_lm_summary>("lm summary", out[1], 1);
        const Surface& s = *surface_;
        const LmSurface surface = s.view();
        const bool presolve = p_.presolve != 0 && frame.matches != nullptr;
        if (presolve)
            recorder.launch(lm_presolve, {dim3(1), dim3(kLmThreads)},
                            LmPresolve{surface.items + LmLists::kItemVectors * size_t{p_.points}, surface.item_nodes + p_.points,
                                       p_.landmarks, p_.match_tukey_mm, frame.motions, frame.matches, s.deformed.as<float4>(),
                                       s.rigid.as<float4>()});
        const LmFrameView given{frame.motions, frame.matches, frame.observations, presolve ? s.rigid.as<float4>() : nullptr};
        recorder.launch(s.shape.kernel, {dim3(s.shape.blocks), dim3(kLmThreads), s.shape.shared, true},
                        LmView{parameters(frame.disparity), surface, given, s.exchange(), motions, summary});
    }

  private:
    LmParameters parameters(const DisparityImage& image) const {
        const float spacing2 = p_.node_spacing_mm * p_.node_spacing_mm;
        return {p_.camera,
                image,
                p_.nodes,
                p_.points,
                p_.landmarks,
                p_.iterations,
                p_.solver == DEFREC_SOLVER_INDEPENDENT ? 0 : p_.cg_iterations,
                p_.icp_weight,
                p_.match_weight,
                p_.patch_weight,
                p_.icp_tukey_mm,
                p_.match_tukey_mm,
                p_.patch_tukey_px,
                p_.association_mm,
                1 / (5 * p_.match_threshold_mm),
                p_.length_weight,
                p_.angle_weight * spacing2,
                p_.rotation_weight * spacing2,
                spacing2,
                p_.damping};
    }
    // False where shared memory does not hold what this solver wants. One block for each multiprocessor: more would only make barriers longer.
    template <class Mode>
    bool choose(const LmTemplate& surface, const LmLists& lists) {
        for (uint32_t most = device_.limits().multiprocessors; most > 0;) {
            const LmPlan plan(surface, lists, most);
            const auto blocks = static_cast<uint32_t>(plan.shares.size());
            const Shape shape{lm_solve<Mode>, blocks, Mode::shared_bytes(p_.nodes, plan.rows, plan.most_places), Mode::kReplicated, Mode::kMatrix};
            if (shape.shared > device_.limits().shared_per_block) return false;
            most = device_.resident_blocks(reinterpret_cast<const void*>(shape.kernel), kLmThreads, shape.shared);
            if (most < blocks) continue;
            surface_ = std::make_unique<Surface>(device_, shape, lists, plan, p_);
            return true;
        }
        return false;
    }

    defrec_lm_params p_;
    Device& device_;
    std::unique_ptr<Surface> surface_;
};

}  // namespace

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device) { return std::make_unique<Lm>(params, device); }

}  // namespace defrec::cuda
