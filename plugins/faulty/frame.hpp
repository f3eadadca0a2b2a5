// What every faulty plugin consists of: the stages of backend cpu behind plugins/base, and one
// thing changed. Each fault is a file that defines `fault`; the file's name is the plugin's.
#pragma once
#include <algorithm>
#include <array>
#include <memory>

#include "plugins/cpu/makers.hpp"

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

// ---- faults in a stage ------------------------------------------------------

using Inputs = std::span<const InBuffer>;
using Outputs = std::span<const OutBuffer>;

// The right stage; a fault derives from it and does something else before or after.
template <class P>
class Right : public Stage {
  public:
    using Params = P;
    Right(const Params& params, const Host& host)
        : params_(params), stage_(cpu::kMakers[StageOf<Params>::value](&params, host)) {}
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
    result.stage = StageOf<typename Wrong::Params>::value;
    result.maker = [](const void* params, const Host& host) -> std::unique_ptr<Stage> {
        return std::make_unique<Wrong>(*static_cast<const typename Wrong::Params*>(params), host);
    };
    return result;
}

// A stage that takes a parameter for 0, whatever is given.
template <auto kParameter>
struct IgnoredIn;
template <class P, class Value, Value P::*kParameter>
struct IgnoredIn<kParameter> : Right<P> {
    IgnoredIn(P params, const Host& host) : Right<P>(without(params), host) {}
    static P without(P params) {
        params.*kParameter = 0;
        return params;
    }
};

template <auto kParameter>
constexpr Fault ignores() {
    return in_stage<IgnoredIn<kParameter>>();
}

// A stage's inputs, of which some are to be changed.
class ChangedInputs {
  public:
    explicit ChangedInputs(Inputs in) : count_(in.size()) {
        std::copy(in.begin(), in.end(), buffers_.begin());
    }
    InBuffer& operator[](size_t index) { return buffers_[index]; }
    void leave_out(size_t index) {
        if (index < count_) buffers_[index] = {};
    }
    // NOLINTNEXTLINE(google-explicit-constructor): stages take spans
    operator Inputs() const { return {buffers_.data(), count_}; }

  private:
    std::array<InBuffer, 8> buffers_;
    size_t count_;
};

}  // namespace defrec::faulty
