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

}  // namespace

// A private counter, one more in the header of every loop; where main returns, the largest goes to
// the shader's slot of the results.
std::vector<uint32_t> LoopCounter::counting(const Shader& shader) {
    Module module(shader.code);
    auto& code = module.instructions();
    const auto opcode = Module::opcode;
    const auto make = Module::make;
    shaders_.emplace_back(shader.name);
    const auto slot = uint32_t(shaders_.size() - 1);
    if (slot >= kSlots) throw std::logic_error("more shaders than slots");

    uint32_t uint_type = 0, main_function = 0, binding = 0;
    for (const auto& instruction : code) {
        if (opcode(instruction) == kTypeInt && instruction[2] == 32 && instruction[3] == 0)
            uint_type = instruction[1];
        if (opcode(instruction) == kEntryPoint) main_function = instruction[2];
        if (opcode(instruction) == kDecorate && instruction[2] == kBinding)
            binding = std::max(binding, instruction[3] + 1);
    }
    if (uint_type == 0 || main_function == 0)
        throw std::logic_error("not a shader as glslang writes it");

    const uint32_t array = module.fresh(), block = module.fresh(), block_pointer = module.fresh(),
                   results = module.fresh();
    const uint32_t element_pointer = module.fresh(), private_pointer = module.fresh(),
                   counter = module.fresh();
    const uint32_t zero = module.fresh(), one = module.fresh(), slot_constant = module.fresh();
    const std::vector<Module::Instruction> decorations{
        make(kDecorate, {array, kArrayStride, 4}), make(kMemberDecorate, {block, 0, kOffset, 0}),
        make(kDecorate, {block, kBlock}), make(kDecorate, {results, kDescriptorSet, 0}),
        make(kDecorate, {results, kBinding, binding})};
    const std::vector<Module::Instruction> globals{
        make(kTypeRuntimeArray, {array, uint_type}),
        make(kTypeStruct, {block, array}),
        make(kTypePointer, {block_pointer, kStorageBuffer, block}),
        make(kVariable, {block_pointer, results, kStorageBuffer}),
        make(kTypePointer, {element_pointer, kStorageBuffer, uint_type}),
        make(kTypePointer, {private_pointer, kPrivate, uint_type}),
        make(kConstant, {uint_type, zero, 0}),
        make(kConstant, {uint_type, one, 1}),
        make(kConstant, {uint_type, slot_constant, slot}),
        make(kVariable, {private_pointer, counter, kPrivate, zero})};

    std::vector<Module::Instruction> result;
    bool decorated = false, declared = false, in_main = false;
    for (auto& instruction : code) {
        const uint32_t op = opcode(instruction);
        if (op == kEntryPoint) {
            instruction.insert(instruction.end(), {results, counter});
            instruction[0] += 2u << 16;
        }
        if (!decorated && op == kDecorate) {
            result.insert(result.end(), decorations.begin(), decorations.end());
            decorated = true;
        }
        if (op == kFunction) {
            if (!declared) result.insert(result.end(), globals.begin(), globals.end());
            declared = true;
            in_main = instruction[2] == main_function;
        }
        if (op == kLoopMerge) {
            const uint32_t before = module.fresh(), after = module.fresh();
            result.push_back(make(kLoad, {uint_type, before, counter}));
            result.push_back(make(kIAdd, {uint_type, after, before, one}));
            result.push_back(make(kStore, {counter, after}));
        }
        if (op == kReturn && in_main) {
            const uint32_t count = module.fresh(), place = module.fresh(), old = module.fresh();
            result.push_back(make(kLoad, {uint_type, count, counter}));
            result.push_back(
                make(kAccessChain, {element_pointer, place, results, zero, slot_constant}));
            result.push_back(make(kAtomicUMax, {uint_type, old, place, one, zero, count}));
        }
        result.push_back(std::move(instruction));
    }
    code = std::move(result);
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
