// See known_answer.hpp.
#include "backends/vulkan/known_answer.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <numeric>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/queue.hpp"
#include "backends/vulkan/recorder.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

constexpr uint32_t kGroups = 16, kGroupSize = 256, kCount = kGroups * kGroupSize;
constexpr const char* kKinds[] = {"products and sums of floats",
                                  "inverse square roots",
                                  "floats rounded to integers",
                                  "32 bit integers",
                                  "64 bit integers",
                                  "sums over a work group",
                                  "bytes and shorts in memory",
                                  "loops"};
constexpr size_t kAnswers = std::size(kKinds);
constexpr size_t kMemory = 6;  // kept in bytes and shorts, not in words

uint32_t scrambled(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

float inverse_root(float x) {
    float y = std::bit_cast<float>(0x5f375a86u - (std::bit_cast<uint32_t>(x) >> 1));
    for (int i = 0; i < 2; ++i) y = y * (1.5f - ((0.5f * x) * y) * y);
    return y;
}

uint32_t walk(uint32_t r0, uint32_t r1) {
    for (uint32_t step = 0, value = r0;; ++step) {
        if (step == 100 + (r1 & 127)) return value;
        value = value * 1664525u + ((value & 0x10000u) != 0 ? 1013904223u : r1);
    }
}

uint32_t tree_sum(uint32_t group) {
    std::array<uint32_t, kGroupSize> tree;
    for (uint32_t i = 0; i < kGroupSize; ++i) tree[i] = scrambled(2 * (group * kGroupSize + i));
    for (uint32_t size = kGroupSize / 2; size > 0; size /= 2)
        for (uint32_t i = 0; i < size; ++i) tree[i] = tree[i] * 5 + tree[i + size];
    return tree[0];
}

int32_t packed_dot(uint32_t a, uint32_t b) {
    int32_t sum = 0;
    for (uint32_t shift = 0; shift < 32; shift += 8)
        sum += int32_t{static_cast<int8_t>(a >> shift)} * static_cast<int8_t>(b >> shift);
    return sum;
}

// Runs the shader's kGroups and what reads its answers, and waits.
template <class Read>
void compute(Device& device, const Shader& shader, std::initializer_list<Binding> answers,
             const Read& read) {
    Recording recording(device);
    Recorder recorder(recording);
    recorder.dispatch(device.kernel(shader), answers, 0, {kGroups});
    recorder.finish();
    Queue queue(device);
    queue.run(recording);
    read(queue);
    queue.wait(queue.signal(), UINT64_MAX);
}

}  // namespace

KnownAnswers expected_answers() {
    KnownAnswers result{std::vector<uint32_t>(kCount * kAnswers), std::vector<uint8_t>(kCount),
                        std::vector<int16_t>(kCount)};
    uint32_t group_sum = 0;
    for (uint32_t i = 0; i < kCount; ++i) {
        if (i % kGroupSize == 0) group_sum = tree_sum(i / kGroupSize);
        uint32_t* answers = &result.words[i * kAnswers];
        const uint32_t r0 = scrambled(2 * i), r1 = scrambled(2 * i + 1);
        const auto s0 = static_cast<int32_t>(r0), s1 = static_cast<int32_t>(r1);
        const float x = float(s0 >> 8), y = float(s1 >> 10) * 0.00048828125f,
                    z = float(static_cast<int32_t>(r0 ^ r1) >> 12);
        const float product = x * y, sum = product + z, difference = z - product;
        answers[0] = std::bit_cast<uint32_t>(sum) ^ (std::bit_cast<uint32_t>(difference) << 1);
        answers[1] = std::bit_cast<uint32_t>(inverse_root(float((r0 >> 4) | 1)));
        const float scaled = sum * 0.0009765625f;
        answers[2] = static_cast<uint32_t>(static_cast<int32_t>(std::floor(scaled)) * 3 +
                                           static_cast<int32_t>(scaled));
        const int32_t quotient = s0 / static_cast<int32_t>((r1 & 0xffff) | 1),
                      shifted = s0 >> (r1 & 15);
        answers[3] = static_cast<uint32_t>(quotient) * 31 + static_cast<uint32_t>(shifted) +
                     static_cast<uint32_t>(std::popcount(r0)) * 7 +
                     static_cast<uint32_t>(std::countr_zero(r1 | 0x80000000u));
        uint64_t wide = uint64_t{r0} * r1 + 0x9e3779b97f4a7c15u;
        wide = (wide ^ (wide >> 30)) * 0xbf58476d1ce4e5b9u;
        const int64_t narrow = (int64_t{s0} * s1) >> 7;
        answers[4] = static_cast<uint32_t>(wide >> 32) ^ static_cast<uint32_t>(narrow);
        answers[5] = group_sum + i % kGroupSize;
        answers[7] = walk(r0, r1);
        result.bytes[i] = static_cast<uint8_t>(r0);
        result.shorts[i] = static_cast<int16_t>(s1 >> 16);
    }
    return result;
}

KnownAnswers computed_answers(Device& device) {
    KnownAnswers result{std::vector<uint32_t>(kCount * kAnswers), std::vector<uint8_t>(kCount),
                        std::vector<int16_t>(kCount)};
    const Buffer words(device, result.words.size() * sizeof(uint32_t)), bytes(device, kCount),
        shorts(device, kCount * sizeof(int16_t));
    compute(device, shaders::known_answer, {words, bytes, shorts}, [&](Queue& queue) {
        queue.read(words, 0, result.words.data(), words.size());
        queue.read(bytes, 0, result.bytes.data(), bytes.size());
        queue.read(shorts, 0, result.shorts.data(), shorts.size());
    });
    return result;
}

std::string difference(const KnownAnswers& expected, const KnownAnswers& computed) {
    std::array<size_t, kAnswers> wrong{};
    for (size_t i = 0; i < expected.words.size(); ++i)
        wrong[i % kAnswers] += expected.words[i] != computed.words[i];
    for (size_t i = 0; i < kCount; ++i)
        wrong[kMemory] +=
            expected.bytes[i] != computed.bytes[i] || expected.shorts[i] != computed.shorts[i];
    std::string text;
    for (size_t kind = 0; kind < kAnswers; ++kind) {
        if (wrong[kind] == 0) continue;
        text.append(text.empty() ? "" : ", ")
            .append(std::to_string(wrong[kind]))
            .append(" of ")
            .append(std::to_string(kCount));
        text.append(" wrong in ").append(kKinds[kind]);
    }
    return text;
}

std::vector<int32_t> expected_packed_dots() {
    std::vector<int32_t> result;
    for (uint32_t i = 0; i < kCount; ++i) {
        const bool lowest = i % 4 == 3;
        const uint32_t a = lowest ? 0x80808080u : scrambled(2 * i),
                       b = lowest ? 0x80808080u : (scrambled(2 * i + 1) & 0xffffff00u) | 0x80u;
        for (const uint32_t other : {b, b ^ 0xffff0000u, ~a})
            result.push_back(packed_dot(a, other));
    }
    return result;
}

std::vector<int32_t> computed_packed_dots(Device& device) {
    std::vector<int32_t> result(3 * kCount);
    const Buffer answers(device, result.size() * sizeof(int32_t));
    compute(device, shaders::known_packed_dot, {answers},
            [&](Queue& queue) { queue.read(answers, 0, result.data(), answers.size()); });
    return result;
}

void check_known_answers(Device& device) {
    const std::string wrong = difference(expected_answers(), computed_answers(device));
    if (!wrong.empty())
        throw StageError(
            DEFREC_ERROR_UNSUPPORTED,
            device.physical().name + " does not compute as the stages' definition needs: " + wrong);
    LogicalDevice& logical = device.logical();
    if (logical.packed_dot() && computed_packed_dots(device) != expected_packed_dots())
        logical.distrust_packed_dot();
}

}  // namespace defrec::vulkan
