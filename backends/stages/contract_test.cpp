// Tests of backends/stages/contract.hpp: tables, checks and views come from one list of buffers.
#include "backends/stages/contract.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace defrec;

namespace {

struct Example {
    static constexpr const char* kName = "example";
    const uint16_t* samples;
    const float* weights;
    uint8_t* result;
    double* trace;

    template <class List>
    void list(List& list, uint64_t count) {
        list.input("samples", samples, count);
        list.optional_input("weights", weights, count);
        list.output("result", result, 2 * count);
        list.optional_output("trace", trace, 1);
    }
};

constexpr uint64_t kCount = 3;

// Memory for every buffer, of the size needed.
struct Memory {
    std::vector<uint16_t> samples = std::vector<uint16_t>(kCount);
    std::vector<float> weights = std::vector<float>(kCount);
    std::vector<uint8_t> result = std::vector<uint8_t>(2 * kCount);
    double trace = 0;
    std::vector<InBuffer> in{{samples.data(), 6}, {weights.data(), 12}};
    std::vector<OutBuffer> out{{result.data(), 6}, {&trace, 8}};
};

// The error message where the buffers are refused, else "".
std::string refusal(const std::vector<InBuffer>& in, const std::vector<OutBuffer>& out) {
    try {
        view_buffers<Example>(kCount, in, out);
    } catch (const StageError& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("the table has each buffer's name, bytes and whether it may be left out") {
    const BufferTable table = table_of<Example>(kCount);
    const auto inputs = table.inputs.all(), outputs = table.outputs.all();
    REQUIRE(inputs.size() == 2);
    REQUIRE(outputs.size() == 2);
    CHECK(inputs[0].name == std::string("samples"));
    CHECK(inputs[0].bytes == 6);
    CHECK(!inputs[0].optional);
    CHECK(inputs[1].bytes == 12);
    CHECK(inputs[1].optional);
    CHECK(outputs[0].bytes == 6);
    CHECK(!outputs[0].optional);
    CHECK(table.outputs.bytes(1) == 8);
    CHECK(table.outputs.bytes(2) == 0);
}

TEST_CASE("views point into the buffers, and are nullptr where an optional one is not given") {
    Memory memory;
    auto views = view_buffers<Example>(kCount, memory.in, memory.out);
    CHECK(views.samples == memory.samples.data());
    CHECK(views.weights == memory.weights.data());
    CHECK(views.result == memory.result.data());
    CHECK(views.trace == &memory.trace);
    memory.in[1] = {nullptr, 0};
    memory.out.pop_back();
    views = view_buffers<Example>(kCount, memory.in, memory.out);
    CHECK(views.samples == memory.samples.data());
    CHECK(views.weights == nullptr);
    CHECK(views.trace == nullptr);
}

TEST_CASE("too few, too many, too small and missing buffers are refused, with their names") {
    Memory memory;
    CHECK(refusal(memory.in, memory.out) == "");
    CHECK(refusal({}, memory.out) == "example: 0 inputs given, 1 to 2 expected");
    CHECK(refusal({memory.in[0], memory.in[1], memory.in[0]}, memory.out) ==
          "example: 3 inputs given, 1 to 2 expected");
    CHECK(refusal(memory.in, {}) == "example: 0 outputs given, 1 to 2 expected");
    CHECK(refusal({{memory.samples.data(), 5}}, memory.out) ==
          "example: samples has 5 bytes, 6 are needed");
    CHECK(refusal({memory.in[0], {memory.weights.data(), 11}}, memory.out) ==
          "example: weights has 11 bytes, 12 are needed");
    CHECK(refusal(memory.in, {{nullptr, 0}}) == "example: result has 0 bytes, 6 are needed");
    CHECK(refusal({{nullptr, 6}}, memory.out) == "example: samples is NULL with a size of 6 bytes");
    CHECK(refusal(memory.in, {memory.out[0], {&memory.trace, 7}}) ==
          "example: trace has 7 bytes, 8 are needed");
}

TEST_CASE("records of prepare are as many as the buffer holds, at most what the parameters say") {
    const std::vector<uint32_t> values(5);
    const auto count = [&](size_t max_count, uint64_t bytes) {
        const InBuffer in[] = {{values.data(), bytes}};
        return view_records<uint32_t>("example", max_count, in).size();
    };
    CHECK(count(3, 20) == 3);
    CHECK(count(8, 20) == 5);
    CHECK(count(8, 19) == 4);
    CHECK_THROWS_AS(view_records<uint32_t>("example", 3, {}), StageError);
}

TEST_CASE("an image ends with its last pixel") {
    CHECK(image_elements(7, 3, 10) == 27);
    CHECK(image_elements(7, 0, 10) == 0);
}
