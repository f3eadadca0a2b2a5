// See test_loop_counter.hpp.
#include "backends/vulkan/test_loop_counter.hpp"

#include <algorithm>
#include <stdexcept>

#include "backends/vulkan/queue.hpp"

namespace defrec::vulkan::test {
namespace {

constexpr uint32_t kSlots = 256;

// SPIR-V 1.5: opcodes and enumerants used here.
enum : uint32_t {
    kEntryPoint = 15,
    kTypeInt = 21,
    kTypeRuntimeArray = 29,
    kTypeStruct = 30,
    kTypePointer = 32,
    kConstant = 43,
    kFunction = 54,
    kFunctionEnd = 56,
    kVariable = 59,
    kLoad = 61,
    kStore = 62,
    kAccessChain = 65,
    kDecorate = 71,
    kMemberDecorate = 72,
    kIAdd = 128,
    kAtomicUMax = 239,
    kLoopMerge = 246,
    kReturn = 253,
    kPrivate = 6,
    kStorageBuffer = 12,
    kBlock = 2,
    kArrayStride = 6,
    kBinding = 33,
    kDescriptorSet = 34,
    kOffset = 35
};

// The module as instructions, and numbers for new results.
class Module {
  public:
    explicit Module(std::span<const uint32_t> code) : header_(code.begin(), code.begin() + 5) {
        for (size_t at = 5; at < code.size(); at += code[at] >> 16)
            instructions_.emplace_back(code.begin() + std::ptrdiff_t(at),
                                       code.begin() + std::ptrdiff_t(at + (code[at] >> 16)));
    }
    using Instruction = std::vector<uint32_t>;
    std::vector<Instruction>& instructions() { return instructions_; }
    uint32_t fresh() { return header_[3]++; }

    static uint32_t opcode(const Instruction& instruction) { return instruction[0] & 0xffff; }
    static Instruction make(uint32_t code, std::vector<uint32_t> operands) {
        operands.insert(operands.begin(), uint32_t(operands.size() + 1) << 16 | code);
        return operands;
    }

    std::vector<uint32_t> words() const {
        std::vector<uint32_t> result = header_;
        for (const Instruction& instruction : instructions_)
            result.insert(result.end(), instruction.begin(), instruction.end());
        return result;
    }

  private:
    std::vector<uint32_t> header_;
    std::vector<Instruction> instructions_;
};

using Instructions = std::vector<Module::Instruction>;

// The identifiers of a shader that the counter needs.
struct ShaderIds {
    uint32_t uint_type = 0, main_function = 0;
    uint32_t binding = 0;  // the first that is free

    explicit ShaderIds(const Instructions& code) {
        for (const auto& instruction : code) {
            const uint32_t op = Module::opcode(instruction);
            if (op == kTypeInt && instruction[2] == 32 && instruction[3] == 0)
                uint_type = instruction[1];
            if (op == kEntryPoint) main_function = instruction[2];
            if (op == kDecorate && instruction[2] == kBinding)
                binding = std::max(binding, instruction[3] + 1);
        }
        if (uint_type == 0 || main_function == 0)
            throw std::logic_error("not a shader as glslang writes it");
    }
};

// The private counter and the buffer of results, and the instructions that deal with them.
class Counter {
  public:
    Counter(Module& module, const ShaderIds& shader, uint32_t slot)
        : module_(module), shader_(shader), slot_(slot) {}

    // Both, as the entry point lists them.
    std::vector<uint32_t> variables() const { return {results_, counter_}; }
    Instructions decorations() const {
        return {make(kDecorate, {array_, kArrayStride, 4}),
                make(kMemberDecorate, {block_, 0, kOffset, 0}), make(kDecorate, {block_, kBlock}),
                make(kDecorate, {results_, kDescriptorSet, 0}),
                make(kDecorate, {results_, kBinding, shader_.binding})};
    }
    Instructions globals() const {
        const uint32_t uint_type = shader_.uint_type;
        return {make(kTypeRuntimeArray, {array_, uint_type}),
                make(kTypeStruct, {block_, array_}),
                make(kTypePointer, {block_pointer_, kStorageBuffer, block_}),
                make(kVariable, {block_pointer_, results_, kStorageBuffer}),
                make(kTypePointer, {element_pointer_, kStorageBuffer, uint_type}),
                make(kTypePointer, {private_pointer_, kPrivate, uint_type}),
                make(kConstant, {uint_type, zero_, 0}),
                make(kConstant, {uint_type, one_, 1}),
                make(kConstant, {uint_type, slot_constant_, slot_}),
                make(kVariable, {private_pointer_, counter_, kPrivate, zero_})};
    }
    Instructions increment() {
        const uint32_t before = module_.fresh(), after = module_.fresh();
        return {make(kLoad, {shader_.uint_type, before, counter_}),
                make(kIAdd, {shader_.uint_type, after, before, one_}),
                make(kStore, {counter_, after})};
    }
    Instructions give_result() {
        const uint32_t count = module_.fresh(), place = module_.fresh(), old = module_.fresh();
        return {make(kLoad, {shader_.uint_type, count, counter_}),
                make(kAccessChain, {element_pointer_, place, results_, zero_, slot_constant_}),
                make(kAtomicUMax, {shader_.uint_type, old, place, one_, zero_, count})};
    }

  private:
    static constexpr auto make = Module::make;
    Module& module_;
    const ShaderIds& shader_;
    uint32_t slot_;
    uint32_t array_ = module_.fresh(), block_ = module_.fresh(), block_pointer_ = module_.fresh(),
             results_ = module_.fresh();
    uint32_t element_pointer_ = module_.fresh(), private_pointer_ = module_.fresh(),
             counter_ = module_.fresh();
    uint32_t zero_ = module_.fresh(), one_ = module_.fresh(), slot_constant_ = module_.fresh();
};

}  // namespace

// A private counter, one more in the header of every loop; where main returns, the largest goes to
// the shader's slot of the results.
std::vector<uint32_t> LoopCounter::counting(const Shader& shader) {
    shaders_.emplace_back(shader.name);
    const auto slot = uint32_t(shaders_.size() - 1);
    if (slot >= kSlots) throw std::logic_error("more shaders than slots");

    Module module(shader.code);
    const ShaderIds ids(module.instructions());
    Counter counter(module, ids, slot);
    Instructions result;
    const auto add = [&](const Instructions& instructions) {
        result.insert(result.end(), instructions.begin(), instructions.end());
    };
    bool decorated = false, declared = false, in_main = false;
    for (auto& instruction : module.instructions()) {
        const uint32_t op = Module::opcode(instruction);
        if (op == kEntryPoint) {
            const std::vector<uint32_t> variables = counter.variables();
            instruction.insert(instruction.end(), variables.begin(), variables.end());
            instruction[0] += uint32_t(variables.size()) << 16;
        }
        if (!decorated && op == kDecorate) {
            add(counter.decorations());
            decorated = true;
        }
        if (op == kFunction) {
            if (!declared) add(counter.globals());
            declared = true;
            in_main = instruction[2] == ids.main_function;
        }
        if (op == kLoopMerge) add(counter.increment());
        if (op == kReturn && in_main) add(counter.give_result());
        result.push_back(std::move(instruction));
    }
    module.instructions() = std::move(result);
    return module.words();
}

LoopCounter::LoopCounter(Device& device) : device_(device) {
    Buffer results(device, kSlots * sizeof(uint32_t));
    device.clear(results);
    device.set_instrument(
        {[this](const Shader& shader) { return counting(shader); }, std::move(results)});
}

std::map<std::string, uint32_t> LoopCounter::max_iterations() {
    std::vector<uint32_t> counts(kSlots);
    Queue queue(device_);
    queue.read(device_.instrument()->results, 0, counts.data(), counts.size() * sizeof(uint32_t));
    queue.wait(queue.signal(), UINT64_MAX);
    std::map<std::string, uint32_t> result;
    for (size_t slot = 0; slot < shaders_.size(); ++slot)
        result[shaders_[slot]] = std::max(result[shaders_[slot]], counts[slot]);
    return result;
}

}  // namespace defrec::vulkan::test
