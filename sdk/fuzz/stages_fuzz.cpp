// Parameters and buffers of the stages: backend cpu accepts what the reference does, and neither
// leaves its buffers. Both give the same bytes in stages whose results are exact.
#include <cstring>

#include "sdk/fuzz/input.hpp"
#include "sdk/fuzz/session.hpp"

using namespace defrec::fuzz;

namespace {

struct Shape {
    uint32_t stage;
    size_t prepared, inputs, outputs;  // buffers
    bool is_exact;
};
constexpr Shape kShapes[] = {
    {DEFREC_STAGE_RECTIFY, 0, 3, 2, true}, {DEFREC_STAGE_STEREO, 0, 4, 2, true},
    {DEFREC_STAGE_ORB, 0, 2, 2, false},    {DEFREC_STAGE_MATCH, 1, 3, 1, false},
    {DEFREC_STAGE_ALIGN, 3, 4, 2, false},  {DEFREC_STAGE_RANSAC, 1, 1, 2, false},
    {DEFREC_STAGE_LM, 5, 4, 2, false},     {DEFREC_STAGE_WARP, 1, 2, 1, false},
};
constexpr size_t kBytes = 1 << 15;  // of a buffer at most
constexpr uint32_t kLargest = 96;   // of sizes and counts
// Beyond all ranges as a count; as a float -0, NaN, infinities, the largest, tiny ones.
constexpr uint32_t kExtremes[] = {0xffffffff, 0x80000000, 0x7fc00000, 0x7f800000,
                                  0xff800000, 0x7f7fffff, 0x80000001};

// Parameters of any stage.
struct Params {
    alignas(8) uint8_t bytes[256] = {};
};

template <class T>
T with_sizes(T params) {
    params.width = 64;
    params.height = 48;
    return params;
}
template <class T>
T with_camera(T params) {
    params = with_sizes(params);
    params.camera = {100, 100, 32, 24, 5, 0};
    return params;
}

// Good parameters of which the input changes some bytes.
template <class T>
void change(T params, Input& input, Params& made) {
    params.struct_size = sizeof params;
    std::memcpy(made.bytes, &params, sizeof params);
    for (uint32_t i = input.number<uint32_t>(0, 3); i > 0; --i) {
        const size_t offset = 4 * input.number<size_t>(1, sizeof params / 4 - 1);
        const uint32_t value =
            input.flag() ? input.number<uint32_t>(0, kLargest) : input.one_of(kExtremes);
        std::memcpy(made.bytes + offset, &value, sizeof value);
    }
}

void make_params(uint32_t stage, Input& input, Params& made) {
    switch (stage) {
        case DEFREC_STAGE_RECTIFY: {
            defrec_rectify_params params{};
            params.source_width = 64;
            params.source_height = 48;
            return change(params, input, made);
        }
        case DEFREC_STAGE_STEREO: {
            defrec_stereo_params params = with_sizes(defrec_stereo_params{});
            params.disparities = 32;
            return change(params, input, made);
        }
        case DEFREC_STAGE_ORB: {
            defrec_orb_params params = with_sizes(defrec_orb_params{});
            params.capacity = 100;
            return change(params, input, made);
        }
        case DEFREC_STAGE_MATCH: {
            defrec_match_params params = with_camera(defrec_match_params{});
            params.landmarks = params.features = 100;
            return change(params, input, made);
        }
        case DEFREC_STAGE_ALIGN: {
            defrec_align_params params = with_camera(defrec_align_params{});
            params.patches = 100;
            params.nodes = 16;
            return change(params, input, made);
        }
        case DEFREC_STAGE_RANSAC: {
            defrec_ransac_params params{};
            params.landmarks = 100;
            return change(params, input, made);
        }
        case DEFREC_STAGE_LM: {
            defrec_lm_params params = with_camera(defrec_lm_params{});
            params.nodes = 16;
            params.edges = params.points = params.landmarks = params.patches = 8;
            params.iterations = 1;
            params.node_spacing_mm = 5;
            return change(params, input, made);
        }
        default: {
            defrec_warp_params params = with_camera(defrec_warp_params{});
            params.nodes = 16;
            params.points = 8;
            return change(params, input, made);
        }
    }
}

class Buffers {
  public:
    Buffers(size_t count, Input& input) {
        for (size_t i = 0; i < count; ++i) {
            std::vector<uint8_t>& bytes =
                bytes_.emplace_back(input.flag() ? kBytes : input.number<size_t>(0, kBytes));
            const auto pattern = input.bytes(input.number<size_t>(0, 64));
            for (size_t at = 0; at < bytes.size() && !pattern.empty(); ++at)
                bytes[at] = static_cast<uint8_t>(pattern[at % pattern.size()] + at / 4096);
        }
    }
    std::vector<defrec_const_buffer> inputs() const {
        std::vector<defrec_const_buffer> result;
        for (const auto& bytes : bytes_) result.push_back({bytes.data(), bytes.size()});
        return result;
    }
    std::vector<defrec_buffer> outputs() {
        std::vector<defrec_buffer> result;
        for (auto& bytes : bytes_) result.push_back({bytes.data(), bytes.size()});
        return result;
    }
    bool operator==(const Buffers&) const = default;

  private:
    std::vector<std::vector<uint8_t>> bytes_;
};

struct Outcome {
    defrec_status create, prepare = DEFREC_OK, run = DEFREC_OK;
    bool operator==(const Outcome&) const = default;
};

Outcome run(defrec_context context, const char* device, const Shape& shape, const Params& params,
            const Buffers& prepared, const Buffers& inputs, Buffers& outputs) {
    defrec_stage stage = nullptr;
    Outcome outcome{defrec_stage_create(context, device, shape.stage, params.bytes, &stage)};
    if (outcome.create != DEFREC_OK) return outcome;
    const auto prepared_list = prepared.inputs(), input_list = inputs.inputs();
    const auto output_list = outputs.outputs();
    if (shape.prepared > 0)
        outcome.prepare = defrec_stage_prepare(stage, prepared_list.data(), prepared_list.size());
    if (outcome.prepare == DEFREC_OK)
        outcome.run = defrec_stage_run(stage, input_list.data(), input_list.size(),
                                       output_list.data(), output_list.size());
    defrec_stage_destroy(stage);
    return outcome;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static defrec_context const context = make_context();
    Input input(data, size);
    const Shape& shape = input.one_of(kShapes);
    Params params;
    make_params(shape.stage, input, params);
    const Buffers prepared(shape.prepared, input), inputs(shape.inputs, input);
    Buffers expected(shape.outputs, input);
    Buffers found = expected;
    const Outcome reference = run(context, "reference", shape, params, prepared, inputs, expected);
    const Outcome cpu = run(context, "cpu", shape, params, prepared, inputs, found);
    if (!(cpu == reference)) __builtin_trap();
    if (shape.is_exact && !(found == expected)) __builtin_trap();
    return 0;
}
