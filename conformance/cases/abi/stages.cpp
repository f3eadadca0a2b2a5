// Stages: their tables, creation, and buffers that do not fit.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "backends/stages/list.hpp"
#include "conformance/cases/abi/abi.hpp"
#include "conformance/scenes/jobs.hpp"
#include "conformance/scenes/sample_job.hpp"
#include "sdk/contract/stage_params.hpp"
#include "sdk/plugin/table_functions.hpp"

namespace defrec::conformance {
namespace {

// Up to here stages have a case of their own for their limits; stage_create tries those of the
// later ones, so that the list of cases, which certified reports have, stays as it is.
constexpr uint32_t kLastLimited = DEFREC_STAGE_RANSAC;

void table(CaseRun& run, uint32_t stage) {
    const defrec_stage_table& table = run.subject().stage_table(stage);
    require(table.struct_size >= sizeof table, "the table has ", table.struct_size,
            " bytes, at least ", sizeof table, " expected");
    require(table.stage == stage, "the table says that it is of stage ", table.stage);
    require(table.stage_version == 1, "the table is of version ", table.stage_version,
            " of the stage's definition, 1 expected");
    const char* missing = missing_function(table);
    require(missing == nullptr, "the table has NULL for ", missing);
    require(run.subject().table().stage(run.subject().table().self, stage) == &table,
            "stage() gave another table the second time");
}

// One parameter beyond each of the definition's limits.
template <class Params>
using Beyond = std::pair<const char*, void (*)(Params&)>;

template <class Params>
void refuse_all(CaseRun& run, uint32_t stage, std::initializer_list<Beyond<Params>> beyonds) {
    const Session& session = run.subject();
    const defrec_stage_table& stage_table = session.stage_table(stage);
    const StageJob job = sample_job(stage);
    for (const auto& [what, change] : beyonds) {
        Params params = *static_cast<const Params*>(job.params.get());
        change(params);
        if (range_error(params).empty()) fail(DEFREC_ERROR_INTERNAL, "the contract allows ", what);
        defrec_pstage* made = nullptr;
        const defrec_status status = stage_table.create(session.device(), &params, &made);
        if (status >= 0 && made != nullptr) stage_table.destroy(made);
        require_refused(session, concat("create with ", what), status);
        require(made == nullptr, "create refused ", what, ", but wrote its output");
    }
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Limits of the disparity image and the camera, which lm and warp have in common.
template <class Params>
void refuse_image(CaseRun& run, uint32_t stage) {
    refuse_all<Params>(
        run, stage,
        {{"width 1", [](auto& p) { p.width = 1; }},
         {"width 8193", [](auto& p) { p.width = p.stride = DEFREC_MAX_SIDE + 1; }},
         {"height 1", [](auto& p) { p.height = 1; }},
         {"height 8193", [](auto& p) { p.height = DEFREC_MAX_SIDE + 1; }},
         {"a stride less than the width", [](auto& p) { p.stride = p.width - 1; }},
         {"stride 1048577", [](auto& p) { p.stride = 1048577; }},
         {"4194305 control points", [](auto& p) { p.nodes = 4194305; }},
         {"4194305 points", [](auto& p) { p.points = 4194305; }},
         {"a focal length of 0", [](auto& p) { p.camera.fx = 0; }},
         {"a negative focal length", [](auto& p) { p.camera.fy = -1; }},
         {"an infinite principal point", [](auto& p) { p.camera.cx = double{kInfinity}; }},
         {"a baseline of 0", [](auto& p) { p.camera.baseline_mm = 0; }},
         {"a disparity_offset_px of 4097", [](auto& p) { p.camera.disparity_offset_px = 4097; }}});
}

// Limits of the stages of a surface.
void surface_limits(CaseRun& run, uint32_t stage) {
    switch (stage) {
        case DEFREC_STAGE_LM:
            refuse_image<defrec_lm_params>(run, stage);
            return refuse_all<defrec_lm_params>(
                run, stage,
                {{"an unknown solver", [](auto& p) { p.solver = 3; }},
                 {"4194305 edges", [](auto& p) { p.edges = 4194305; }},
                 {"4194305 landmarks", [](auto& p) { p.landmarks = 4194305; }},
                 {"4194305 patches", [](auto& p) { p.patches = 4194305; }},
                 {"no iterations", [](auto& p) { p.iterations = 0; }},
                 {"no cg_iterations", [](auto& p) { p.cg_iterations = 0; }},
                 {"a negative icp_weight", [](auto& p) { p.icp_weight = -1; }},
                 {"an infinite arap_weight", [](auto& p) { p.arap_weight = kInfinity; }},
                 {"a damping that is no number", [](auto& p) { p.damping = std::nanf(""); }},
                 {"a trust_last_step of 2", [](auto& p) { p.trust_last_step = 2; }}});
        case DEFREC_STAGE_WARP:
            refuse_image<defrec_warp_params>(run, stage);
            return refuse_all<defrec_warp_params>(
                run, stage,
                {{"a negative tolerance_mm", [](auto& p) { p.tolerance_mm = -1; }},
                 {"an infinite tolerance_mm", [](auto& p) { p.tolerance_mm = kInfinity; }}});
        default:
            fail(DEFREC_ERROR_INTERNAL, "no limits are known of ", stage_name(stage));
    }
}

void limits(CaseRun& run, uint32_t stage) {
    switch (stage) {
        case DEFREC_STAGE_RECTIFY:
            return refuse_all<defrec_rectify_params>(
                run, stage,
                {{"source_stride 1048577", [](auto& p) { p.source_stride = 1048577; }},
                 {"stride 1048577", [](auto& p) { p.stride = 1048577; }},
                 {"highlight_radius 0", [](auto& p) { p.highlight_radius = 0; }},
                 {"highlight_radius 17", [](auto& p) { p.highlight_radius = 17; }}});
        case DEFREC_STAGE_STEREO:
            return refuse_all<defrec_stereo_params>(
                run, stage,
                {{"radius 1", [](auto& p) { p.radius = 1; }},
                 {"radius 7", [](auto& p) { p.radius = 7; }},
                 {"refine_radius 7", [](auto& p) { p.refine_radius = 7; }},
                 {"511 disparities", [](auto& p) { p.disparities = 511; }},
                 {"fill_radius 9", [](auto& p) { p.fill_radius = 9; }},
                 {"smooth_radius 4", [](auto& p) { p.smooth_radius = 4; }},
                 {"smooth_range 257", [](auto& p) { p.smooth_range = 257; }},
                 {"9 smooth_passes", [](auto& p) { p.smooth_passes = 9; }}});
        case DEFREC_STAGE_ORB:
            return refuse_all<defrec_orb_params>(
                run, stage,
                {{"9 levels", [](auto& p) { p.levels = 9; }},
                 {"cells of 3 px", [](auto& p) { p.cell = 3; }},
                 {"cells of 17 px", [](auto& p) { p.cell = 17; }},
                 {"threshold 255", [](auto& p) { p.threshold = 255; }},
                 {"capacity 65536", [](auto& p) { p.capacity = 65536; }},
                 {"spacing 64", [](auto& p) { p.spacing = 64; }},
                 {"4 halvings", [](auto& p) { p.halvings = 4; }}});
        case DEFREC_STAGE_MATCH:
            return refuse_all<defrec_match_params>(
                run, stage,
                {{"no landmarks", [](auto& p) { p.landmarks = 0; }},
                 {"65536 landmarks", [](auto& p) { p.landmarks = 65536; }},
                 {"65536 features", [](auto& p) { p.features = 65536; }},
                 {"max_distance 257", [](auto& p) { p.max_distance = 257; }},
                 {"ratio 257", [](auto& p) { p.ratio = 257; }}});
        case DEFREC_STAGE_ALIGN:
            return refuse_all<defrec_align_params>(
                run, stage,
                {{"level 4", [](auto& p) { p.level = 4; }},
                 {"patch_radius 8", [](auto& p) { p.patch_radius = 8; }},
                 {"search_radius 17", [](auto& p) { p.search_radius = 17; }}});
        case DEFREC_STAGE_RANSAC:
            return refuse_all<defrec_ransac_params>(
                run, stage,
                {{"1025 references", [](auto& p) { p.references = 1025; }},
                 {"101 iterations", [](auto& p) { p.iterations = 101; }}});
        default:
            return surface_limits(run, stage);
    }
}

void create(CaseRun& run, uint32_t stage) {
    const StageJob job = sample_job(stage);
    for (int round = 0; round < 3; ++round) {
        const Stage first(run.subject(), stage, job.params.get());
        const Stage second(run.subject(), stage, job.params.get());
        require(first.get() != second.get(), "create gave the same stage twice");
    }
    if (stage > kLastLimited) limits(run, stage);
}

// A stage with its sample job's buffers, to be called wrongly.
class WrongCalls {
  public:
    WrongCalls(CaseRun& run, uint32_t stage)
        : run_(run), job_(sample_job(stage)), queue_(run.subject()), counts_(buffer_counts(stage)) {
        for (const Input& input : job_.prepare) prepared_.push_back(upload(input.bytes));
        for (const Input& input : job_.in)
            in_.push_back(input.given ? upload(input.bytes) : Buffer());
        for (const Output& output : job_.out) {
            before_.push_back(pattern_bytes(output.size, before_.size()));
            out_.push_back(upload(before_.back()));
        }
        stage_.emplace(run.subject(), stage, job_.params.get());
        if (!prepared_.empty()) stage_->prepare(queue_, prepared_);
    }

    void counts_and_nulls() {
        expect_refusal("no buffers at all", {}, {});
        for (size_t count = 0; count < counts_.min_in; ++count)
            expect_refusal(concat(count, " inputs"), first(in_, count), all(out_));
        for (size_t count = 0; count < counts_.min_out; ++count)
            expect_refusal(concat(count, " outputs"), all(in_), first(out_, count));
        for (const size_t count : {counts_.max_in + 1, size_t{40}}) {
            auto more = all(in_);
            more.resize(count, in_[0].get());
            expect_refusal(concat(count, " inputs"), more, all(out_));
        }
        for (const size_t count : {counts_.max_out + 1, size_t{40}}) {
            auto more = all(out_);
            more.resize(count, out_[0].get());
            expect_refusal(concat(count, " outputs"), all(in_), more);
        }
        for (size_t i = 0; i < counts_.min_in; ++i)
            expect_refusal(concat("input ", i, " NULL"), without(in_, i), all(out_));
        for (size_t i = 0; i < counts_.min_out; ++i)
            expect_refusal(concat("output ", i, " NULL"), all(in_), without(out_, i));
    }

    void too_small() {
        for (size_t i = 0; i < in_.size(); ++i) {
            // How many features there are is known to the device alone.
            if (!job_.in[i].given || (job_.stage() == DEFREC_STAGE_MATCH && i == 1)) continue;
            const Buffer small(run_.subject(), job_.in[i].bytes.size() - 1);
            auto pointers = all(in_);
            pointers[i] = small.get();
            expect_refusal(concat("input ", i, " a byte too small"), pointers, all(out_));
        }
        for (size_t i = 0; i < out_.size(); ++i) {
            const Buffer small(run_.subject(), job_.out[i].size - 1);
            auto pointers = all(out_);
            pointers[i] = small.get();
            expect_refusal(concat("output ", i, " a byte too small"), all(in_), pointers);
        }
    }

    void wrong_preparation() {
        const defrec_stage_table& table = run_.subject().stage_table(job_.stage());
        const auto refuse = [&](const std::string& what, const std::vector<defrec_pbuffer*>& in) {
            require_refused(run_.subject(), concat("prepare with ", what),
                            table.prepare(stage_->get(), queue_.get(), in.data(), in.size()));
        };
        auto more = all(prepared_);
        more.insert(more.end(), job_.optional_left_out + 1, prepared_[0].get());
        refuse("a buffer too many", more);
        refuse("no buffers", {});
    }

    // All refusals touched nothing, and the stage still does its work.
    void finish() {
        for (size_t i = 0; i < out_.size(); ++i) {
            Bytes after(before_[i].size());
            queue_.read(out_[i], after);
            queue_.finish();
            require(after == before_[i], "enqueue refused, but wrote output ", i);
        }
        if (!prepared_.empty()) stage_->prepare(queue_, prepared_);
        stage_->enqueue(queue_, in_, out_);
        Bytes after(before_[0].size());
        queue_.read(out_[0], after);
        queue_.finish();
        require(after != before_[0], "after refusals the stage gives nothing");
    }

  private:
    using Pointers = std::vector<defrec_pbuffer*>;
    Buffer upload(const Bytes& bytes) {
        Buffer buffer(run_.subject(), bytes.size());
        queue_.write(buffer, bytes);
        return buffer;
    }
    static Pointers all(const std::vector<Buffer>& buffers) {
        return first(buffers, buffers.size());
    }
    static Pointers first(const std::vector<Buffer>& buffers, size_t count) {
        Pointers pointers;
        for (size_t i = 0; i < count; ++i) pointers.push_back(buffers[i].get());
        return pointers;
    }
    static Pointers without(const std::vector<Buffer>& buffers, size_t i) {
        Pointers pointers = all(buffers);
        pointers[i] = nullptr;
        return pointers;
    }
    void expect_refusal(const std::string& what, const Pointers& in, const Pointers& out) {
        const defrec_stage_table& table = run_.subject().stage_table(job_.stage());
        require_refused(run_.subject(), concat("enqueue with ", what),
                        table.enqueue(stage_->get(), queue_.get(), in.data(), in.size(), out.data(),
                                      out.size()));
    }

    CaseRun& run_;
    StageJob job_;
    Queue queue_;
    BufferCounts counts_;
    std::vector<Bytes> before_;
    std::vector<Buffer> prepared_, in_, out_;
    std::optional<Stage> stage_;
};

void wrong_counts(CaseRun& run, uint32_t stage) {
    WrongCalls calls(run, stage);
    calls.counts_and_nulls();
    calls.finish();
}
void small_buffers(CaseRun& run, uint32_t stage) {
    WrongCalls calls(run, stage);
    calls.too_small();
    calls.finish();
}
void wrong_prepare(CaseRun& run, uint32_t stage) {
    WrongCalls calls(run, stage);
    calls.wrong_preparation();
    calls.finish();
}

}  // namespace

void add_abi_stage_cases(std::vector<Case>& cases) {
    add_abi_stage_case(cases, "stage_table",
                       "The stage's table is complete and of the definition's version.", table);
    add_abi_stage_case(cases, "stage_create",
                       "The stage can be created and destroyed without being used.", create);
    add_abi_stage_case(cases, "stage_limits",
                       "Parameters beyond the definition's limits are refused with a sentence.",
                       limits, 0, kLastLimited + 1);
    add_abi_stage_case(cases, "wrong_buffers",
                       "Too few, too many and missing buffers are refused, and no output touched.",
                       wrong_counts);
    add_abi_stage_case(cases, "small_buffers",
                       "Buffers that are a byte too small are refused, and no output touched.",
                       small_buffers);
    add_abi_stage_case(cases, "wrong_prepare",
                       "Too few and too many buffers to prepare are refused.", wrong_prepare,
                       kFirstPreparedStage);
}

}  // namespace defrec::conformance
