// Queues: order, what runs beside what, reads into all kinds of memory, waiting.
#include "backends/cuda/gpu/queue.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <thread>

#include "backends/cuda/gpu/test_device.hpp"
#include "backends/cuda/gpu/test_kernels.hpp"

using namespace defrec;
using cuda::Buffer;
using cuda::HostBuffer;
using cuda::Queue;

namespace {

constexpr uint32_t kCount = 100000;
constexpr uint64_t kBytes = kCount * sizeof(uint32_t);

std::vector<uint32_t> numbers() {
    std::vector<uint32_t> values(kCount);
    std::iota(values.begin(), values.end(), 1u);
    return values;
}

std::vector<uint8_t> bytes_without_zero(uint64_t size) {
    std::vector<uint8_t> values(size);
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<uint8_t>(1 + i * 2654435761u % 255);
    return values;
}

// out[i] = in[i] + add, slowly.
std::shared_ptr<const cuda::StageRun> adding(uint64_t serial, uint64_t stage, const Buffer& in,
                                             const Buffer& out, uint32_t add) {
    auto run = std::make_shared<cuda::StageRun>();
    run->serial = serial;
    run->stage = stage;
    run->reads = {{in.data(), in.size()}};
    run->writes = {{out.data(), out.size()}};
    cuda::Recorder recorder(run->recording);
    cuda::record_slow_add(recorder, in.as<uint32_t>(), out.as<uint32_t>(), kCount, add);
    return run;
}

}  // namespace

TEST_CASE("what is written comes back, whatever memory it is read into") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer buffer(under_test::device(), kBytes);
    const std::vector<uint32_t> values = numbers();
    std::vector<uint32_t> plain(kCount);
    const HostBuffer locked(under_test::device(), kBytes);
    queue.write(buffer, 0, values.data(), kBytes);
    queue.read(buffer, 0, plain.data(), kBytes);
    queue.read(buffer, 4, locked.data(), kBytes - 4);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(plain == values);
    CHECK(std::memcmp(locked.data(), values.data() + 1, kBytes - 4) == 0);
}

TEST_CASE("operations wait for those whose memory they touch") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer first(under_test::device(), kBytes), second(under_test::device(), kBytes),
        third(under_test::device(), kBytes);
    std::vector<uint32_t> values = numbers(), out(kCount);
    const auto one = adding(1000001, 1, first, second, 1),
               two = adding(1000002, 2, second, third, 2),
               back = adding(1000003, 3, third, first, 3);
    for (uint32_t round = 0; round < 5; ++round) {
        values[0] = round;
        queue.write(first, 0, values.data(), kBytes);
        queue.run(one);
        queue.run(two);
        queue.run(back);
        queue.write(third, 0, values.data(), kBytes);  // not before `back` has read
        queue.run(one);
        queue.read(second, 0, out.data(), kBytes);
        CHECK(queue.wait(queue.signal(), UINT64_MAX));
        CHECK(out[0] == round + 7);
        CHECK(out[kCount - 1] == kCount + 7);
    }
}

TEST_CASE("page-locked memory that a queue reads into and from is written and read in order") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer first(under_test::device(), kBytes), second(under_test::device(), kBytes),
        third(under_test::device(), kBytes);
    const HostBuffer between(under_test::device(), kBytes);
    const auto slow = adding(1000004, 1, first, second, 1);
    const std::vector<uint32_t> values = numbers();
    std::vector<uint32_t> out(kCount);
    queue.write(first, 0, values.data(), kBytes);
    queue.run(slow);
    queue.read(second, 0, between.data(), kBytes);
    queue.write_in_place(third, 0, between.data(), kBytes);
    queue.read(first, 0, between.data(), kBytes);
    queue.read(third, 0, out.data(), kBytes);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(out[0] == values[0] + 1);
    CHECK(out[kCount - 1] == values[kCount - 1] + 1);
    CHECK(std::memcmp(between.data(), values.data(), kBytes) == 0);
}

TEST_CASE("runs that have nothing to do are waited for like others") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer buffer(under_test::device(), kBytes);
    const std::vector<uint32_t> values = numbers();
    queue.write(buffer, 0, values.data(), kBytes);
    for (const uint64_t stage : {1, 2}) {
        auto nothing = std::make_shared<cuda::StageRun>();
        nothing->serial = 1000010 + stage;
        nothing->stage = stage;
        nothing->reads = {{buffer.data(), buffer.size()}};
        queue.run(std::move(nothing));
    }
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    const std::vector<std::byte> bytes = contents(queue, buffer);
    CHECK(std::memcmp(bytes.data(), values.data(), kBytes) == 0);
}

// What an application does beside its tracker: neither may notice the other.
TEST_CASE(
    "a capture by another thread, in the mode that CUDA has by default, and a queue's work are "
    "both left in peace") {
    if (!under_test::available()) return;
    const auto in_use = [](auto&& call) {
        const cuda::Gpu::Use use(under_test::device());
        return call();
    };
    cudaStream_t stream = nullptr;
    REQUIRE(in_use([&] { return cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking); }) ==
            cudaSuccess);
    REQUIRE(in_use([&] { return cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal); }) ==
            cudaSuccess);
    const std::vector<uint32_t> values = numbers();
    std::vector<std::byte> bytes;
    std::string failure;
    std::thread beside([&] {
        try {
            Queue queue(under_test::device());
            const Buffer buffer(under_test::device(), kBytes);
            queue.write(buffer, 0, values.data(), kBytes);
            bytes = contents(queue, buffer);
        } catch (const std::exception& error) {
            failure = error.what();
        }
    });
    beside.join();
    CHECK(failure == "");
    REQUIRE(bytes.size() == kBytes);
    CHECK(std::memcmp(bytes.data(), values.data(), kBytes) == 0);
    cudaGraph_t graph = nullptr;
    CHECK(in_use([&] { return cudaStreamEndCapture(stream, &graph); }) == cudaSuccess);
    in_use([&] { return graph == nullptr ? cudaSuccess : cudaGraphDestroy(graph); });
    in_use([&] { return cudaStreamDestroy(stream); });
}

TEST_CASE("a page-locked source may be read until the signal; a plain one before write returns") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer buffer(under_test::device(), kBytes), other(under_test::device(), kBytes);
    const HostBuffer source(under_test::device(), kBytes);
    std::vector<uint32_t> plain = numbers(), out(kCount), out_other(kCount);
    std::memcpy(source.data(), plain.data(), kBytes);
    queue.write_in_place(buffer, 0, source.data(), kBytes);
    queue.write(other, 0, plain.data(), kBytes);
    std::fill(plain.begin(), plain.end(), 0u);
    queue.read(buffer, 0, out.data(), kBytes);
    queue.read(other, 0, out_other.data(), kBytes);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(out == numbers());
    CHECK(out_other == numbers());
}

TEST_CASE("a read that is forgotten leaves its destination as it is, and others are delivered") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer buffer(under_test::device(), kBytes);
    const std::vector<uint32_t> values = numbers(), untouched(kCount);
    std::vector<uint32_t> forgotten = untouched, out = untouched;
    queue.write(buffer, 0, values.data(), kBytes);
    queue.read(buffer, 0, forgotten.data(), kBytes);
    queue.read(buffer, 0, out.data(), kBytes);
    SUBCASE("before it is submitted") { queue.forget_read(forgotten.data()); }
    SUBCASE("after") {
        queue.signal();
        queue.forget_read(forgotten.data());
    }
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(forgotten == untouched);
    CHECK(out == values);
}

TEST_CASE("waiting: values not signalled, time-outs, any thread's values again") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    CHECK(!queue.wait(1, 0));
    const uint64_t first = queue.signal(), second = queue.signal();
    CHECK(second == first + 1);
    CHECK(queue.wait(second, UINT64_MAX));
    CHECK(queue.wait(first, 0));
    CHECK(!queue.wait(second + 1, 1000));
}

TEST_CASE("a wait keeps its time-out while another thread lets the queue settle") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer first(under_test::device(), kBytes), second(under_test::device(), kBytes);
    const auto slow = adding(1000005, 1, first, second, 1);
    for (int i = 0; i < 2000; ++i) queue.run(slow);
    const uint64_t value = queue.signal();
    std::thread settling([&] { queue.settle(); });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    int timed_out = 0;
    while (!queue.wait(value, 10000)) ++timed_out;
    CHECK(timed_out > 1);
    settling.join();
}

TEST_CASE("more sequences of operations than graphs are kept") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    const Buffer buffer(under_test::device(), kBytes);
    for (uint32_t round = 0; round < 3; ++round)
        for (uint32_t i = 0; i < 150; ++i) {
            const uint32_t value = 1000 * round + i;
            uint32_t back = 0;
            queue.write(buffer, 4 * i, &value, 4);
            queue.read(buffer, 4 * i, &back, 4);
            CHECK(queue.wait(queue.signal(), UINT64_MAX));
            CHECK(back == value);
        }
}

TEST_CASE("ranges of every size and alignment are copied, and nothing beside them") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    constexpr uint64_t kMax = (1 << 19) + 1, kRim = 32;
    const Buffer buffer(under_test::device(), kMax + 2 * kRim);
    const std::vector<uint8_t> values = bytes_without_zero(kMax);
    std::vector<uint8_t> out(buffer.size());
    for (const uint64_t size :
         {uint64_t{1}, uint64_t{15}, uint64_t{16}, uint64_t{17}, uint64_t{70003}, kMax - 1, kMax})
        for (const uint64_t offset : {0, 1, 4, 16}) {
            under_test::device().clear(buffer.data(), buffer.size());
            queue.write(buffer, kRim + offset, values.data(), size);
            queue.read(buffer, 0, out.data(), out.size());
            REQUIRE(queue.wait(queue.signal(), UINT64_MAX));
            const auto first = out.begin() + static_cast<std::ptrdiff_t>(kRim + offset),
                       end = first + static_cast<std::ptrdiff_t>(size);
            CHECK(std::equal(first, end, values.begin()));
            CHECK(std::count(out.begin(), first, 0) == first - out.begin());
            CHECK(std::count(end, out.end(), 0) == out.end() - end);
        }
}

TEST_CASE("many results of every size and alignment are there once the graph has run") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    constexpr uint64_t kMax = 1 << 19, kOffsets = 64;
    const Buffer buffer(under_test::device(), kMax + kOffsets);
    const std::vector<uint8_t> values = bytes_without_zero(buffer.size());
    queue.write(buffer, 0, values.data(), values.size());
    REQUIRE(queue.wait(queue.signal(), UINT64_MAX));
    for (const size_t count : {1, 2, 16, 17, 40})
        for (const uint64_t size : {uint64_t{1}, uint64_t{17}, uint64_t{4099}, kMax}) {
            std::vector<std::vector<uint8_t>> results(count, std::vector<uint8_t>(size));
            const auto offset = [](size_t i) { return (i * 4 + i / 4) % kOffsets; };
            for (size_t i = 0; i < count; ++i)
                queue.read(buffer, offset(i), results[i].data(), size);
            REQUIRE(queue.wait(queue.signal(), UINT64_MAX));
            for (size_t i = 0; i < count; ++i)
                CHECK(std::equal(results[i].begin(), results[i].end(),
                                 values.begin() + static_cast<std::ptrdiff_t>(offset(i))));
        }
}

// What is freed leaves its address to the next that asks, also where the driver has given the
// memory behind it back in between.
TEST_CASE("memory that takes the place of freed memory is not taken for it") {
    if (!under_test::available()) return;
    Queue queue(under_test::device());
    std::vector<uint32_t> values = numbers(), out(kCount);
    for (uint32_t round = 0; round < 3; ++round)
        for (const uint64_t bytes :
             {uint64_t{4}, uint64_t{68}, uint64_t{4096}, kBytes, uint64_t{1} << 22}) {
            const Buffer buffer(under_test::device(), bytes);
            const HostBuffer source(under_test::device(), bytes),
                destination(under_test::device(), bytes);
            const uint64_t used = std::min(bytes, kBytes);
            values[0] = 1000 * round + static_cast<uint32_t>(bytes);
            std::fill(out.begin(), out.end(), 0u);
            std::memcpy(source.data(), values.data(), used);
            queue.write_in_place(buffer, 0, source.data(), bytes);
            queue.read(buffer, 0, out.data(), used);
            queue.read(buffer, 0, destination.data(), bytes);
            REQUIRE(queue.wait(queue.signal(), UINT64_MAX));
            CHECK(std::memcmp(out.data(), values.data(), used) == 0);
            CHECK(std::memcmp(destination.data(), source.data(), bytes) == 0);
        }
}

TEST_CASE(
    "a buffer that the device cannot hold is out of memory, with what was asked for in the text") {
    if (!under_test::available()) return;
    try {
        Buffer(under_test::device(), uint64_t{1} << 50);
        FAIL("a petabyte was given");
    } catch (const StageError& error) {
        CHECK(error.status() == DEFREC_ERROR_OUT_OF_MEMORY);
        CHECK(std::string(error.what()).find(std::to_string(uint64_t{1} << 50)) !=
              std::string::npos);
    }
    uint32_t back = 1;
    Queue queue(under_test::device());
    const Buffer small(under_test::device(), 4);
    under_test::device().clear(small.data(), 4);
    queue.read(small, 0, &back, 4);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(back == 0);
}
