// What every faulty plugin consists of: the stages of backend cpu behind plugins/base, and one thing changed. Each fault is a
// file that defines `fault`; the file's name is the plugin's.
#pragma once
#include <algorithm>
#include <array>
#include <memory>

#include "backends/cpu/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace defrec::faulty {

struct Tables {
    defrec_plugin plugin;  // self differs from instance to instance; the frame fills it in
    std::array<defrec_stage_table, DEFREC_STAGE_COUNT_V1> stages;
};
// As they are without the fault. Every stage has the same functions but for create.
extern Tables good;

struct Fault {
    // A fault in a stage: its number, and what makes it instead.
    uint32_t stage = DEFREC_STAGE_COUNT_V1;
    StageMaker maker = nullptr;
    // A fault at the border: replaces entries of the tables that the host gets ...
    void (*change)(Tables& tables) = nullptr;
    // ... or of the host's table that the plugin gets.
    void (*change_host)(defrec_host& host) = nullptr;
};
extern const Fault fault;

// ---- faults in a stage ---------------------------------------------------------------------------------------------

// A stage's number and its right maker, by its parameters.
template <uint32_t kNumber, auto kMake>
struct StageEntry {
    static constexpr uint32_t number = kNumber;
    static constexpr auto make = kMake;
};
// clang-format off
template <class Params> struct StageOf;
template <> struct StageOf<defrec_rectify_params> : StageEntry<DEFREC_STAGE_RECTIFY, cpu::make_rectify> {};
template <> struct StageOf<defrec_stereo_params> : StageEntry<DEFREC_STAGE_STEREO, cpu::make_stereo> {};
template <> struct StageOf<defrec_orb_params> : StageEntry<DEFREC_STAGE_ORB, cpu::make_orb> {};
template <> struct StageOf<defrec_match_params> : StageEntry<DEFREC_STAGE_MATCH, cpu::make_match> {};
template <> struct StageOf<defrec_align_params> : StageEntry<DEFREC_STAGE_ALIGN, cpu::make_align> {};
template <> struct StageOf<defrec_ransac_params> : StageEntry<DEFREC_STAGE_RANSAC, cpu::make_ransac> {};
template <> struct StageOf<defrec_lm_params> : StageEntry<DEFREC_STAGE_LM, cpu::make_lm> {};
template <> struct StageOf<defrec_warp_params> : StageEntry<DEFREC_STAGE_WARP, cpu::make_warp> {};
// clang-format on

using Inputs = std::span<const InBuffer>;
using Outputs = std::span<const OutBuffer>;

// The right stage; a fault derives from it and does something else before or after.
template <class P>
class Right : public Stage {
  public:
    using Params = P;
    Right(const Params& params, const Host& host) : params_(params), stage_(StageOf<Params>::make(params, host)) {}
    void prepare(Inputs in) override { stage_->prepare(in); }
    void run(Inputs in, Outputs out) override { stage_->run(in, out); }

  protected:
    const Params& params() const { return params_; }

  private:
    Params params_;
    std::unique_ptr<Stage> stage_;
};

template <class Wrong>
constexpr Fault in_stage() {
    Fault result;
    result.stage = StageOf<typename Wrong::Params>::number;
    result.maker = [](const void* params, const Host& host) -> std::unique_ptr<Stage> {
        return std::make_unique<Wrong>(*static_cast<const typename Wrong::Params*>(params), host);
    };
    return result;
}

// A stage's inputs, of which some are to be changed.
class ChangedInputs {
  public:
    explicit ChangedInputs(Inputs in) : count_(in.size()) { std::copy(in.begin(), in.end(), buffers_.begin()); }
    InBuffer& operator[](size_t index) { return buffers_[index]; }
    void leave_out(size_t index) {
        if (index < count_) buffers_[index] = {};
    }
    operator Inputs() const { return {buffers_.data(), count_}; }

  private:
    std::array<InBuffer, 8> buffers_;
    size_t count_;
};

}  // namespace defrec::faulty
