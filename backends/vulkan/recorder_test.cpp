// Operations that have nothing in common run beside each other; whatever else happens, each sees
// what those before it wrote.
#include "backends/vulkan/recorder.hpp"

#include <doctest/doctest.h>

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "backends/vulkan/queue.hpp"
#include "backends/vulkan/test_device.hpp"
#include "shaders.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

using Words = std::array<uint32_t, 4>;

constexpr struct {
    int32_t width = 4, height = 4, unused[8] = {};
} kRows;  // that rectify_mask is given

std::shared_ptr<const Kernel> rows_kernel() {
    return under_test::device().kernel(shaders::rectify_mask);
}
Buffer words(Device& device) { return Buffer(device, sizeof(Words)); }

void add_copy(Recorder& recorder, const Buffer& from, const Buffer& to) {
    recorder.copy(from, to, sizeof(Words));
}
void add_rows(Recorder& recorder, const Buffer& state, const Buffer& next) {
    recorder.dispatch(rows_kernel(), {state, next}, kRows, {1, 1});
}
void add_rows_beside(Recorder& recorder, const Buffer& state, const Buffer& next) {
    recorder.beside(rows_kernel(), {state, next}, kRows, {1, 1});
}
template <class Record>
std::unique_ptr<Recording> record(Device& device, Record&& add) {
    auto recording = std::make_unique<Recording>(device);
    Recorder recorder(*recording);
    add(recorder);
    recorder.finish();
    return recording;
}
std::unique_ptr<Recording> record_copy(Device& device, const Buffer& from, const Buffer& to) {
    return record(device, [&](Recorder& recorder) { add_copy(recorder, from, to); });
}
Words read_back(Queue& queue, const Buffer& buffer) {
    Words words{};
    queue.read(buffer, 0, words.data(), sizeof words);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    return words;
}

}  // namespace

TEST_CASE("an operation waits for those that it depends on, and for no other") {
    if (!under_test::available()) return;
    Device& device = under_test::device();
    const Buffer a = words(device), b = words(device), c = words(device), d = words(device),
                 e = words(device);
    // The rounds of one recording are those of one for each operation, joined.
    const auto rounds = [&](const std::vector<std::function<void(Recorder&)>>& operations) {
        const auto whole = record(device, [&](Recorder& recorder) {
            for (const auto& add : operations) add(recorder);
        });
        std::vector<std::unique_ptr<Recording>> recordings;
        std::vector<const Recording*> parts;
        for (const auto& add : operations) {
            recordings.push_back(record(device, add));
            parts.push_back(recordings.back().get());
        }
        CHECK(JointRecording(device, parts).rounds() == whole->rounds());
        return whole->rounds();
    };
    const auto copy = [](const Buffer& from, const Buffer& to) {
        return [&](Recorder& recorder) { add_copy(recorder, from, to); };
    };
    const auto rows = [](const Buffer& from, const Buffer& to) {
        return [&](Recorder& recorder) { add_rows(recorder, from, to); };
    };
    CHECK(rounds({copy(a, b), copy(a, c)}) == 1);
    CHECK(rounds({copy(a, b), copy(b, c)}) == 2);  // reads what was written
    CHECK(rounds({copy(a, b), copy(c, a)}) == 2);  // writes what was read
    CHECK(rounds({copy(a, b), copy(c, b)}) == 2);  // both write b
    // What a shader only reads is none of what it writes.
    CHECK(rounds({rows(a, b), rows(a, c)}) == 1);
    CHECK(rounds({rows(a, b), rows(c, a)}) == 2);
    // The last of them in each: of a, b, c; of a, d; of what is read in the third round.
    CHECK(rounds({rows(a, b), rows(b, c), copy(a, d), rows(c, e)}) == 3);
    CHECK(rounds({rows(a, b), rows(b, c), copy(a, d), copy(d, e)}) == 2);
    CHECK(rounds({rows(a, b), rows(b, c), rows(c, d), copy(e, a), copy(e, c)}) == 4);
}

TEST_CASE("what is recorded beside an operation does not wait for it, what follows does") {
    if (!under_test::available()) return;
    Device& device = under_test::device();
    const Buffer a = words(device), b = words(device), c = words(device), d = words(device),
                 e = words(device);
    const auto rounds = [&](auto&& add) { return record(device, add)->rounds(); };
    CHECK(rounds([&](Recorder& recorder) {
              add_rows(recorder, a, b);
              add_rows_beside(recorder, c, b);
          }) == 1);
    CHECK(rounds([&](Recorder& recorder) {
              add_rows(recorder, a, b);
              add_rows_beside(recorder, c, b);
              add_rows_beside(recorder, d, b);
          }) == 1);
    CHECK(rounds([&](Recorder& recorder) {
              add_rows(recorder, a, b);
              add_rows_beside(recorder, c, d);
              add_rows(recorder, d, e);
          }) == 2);
    CHECK(rounds([&](Recorder& recorder) {
              add_rows(recorder, a, b);
              add_rows(recorder, c, d);
              add_rows_beside(recorder, b, e);  // for the first
          }) == 2);
}

TEST_CASE("a dispatch waits for its counts, and they are kept until it has begun") {
    if (!under_test::available()) return;
    Device& device = under_test::device();
    const Buffer a = words(device), b = words(device), counts = words(device);
    const auto counted = record(device, [&](Recorder& recorder) {
        recorder.fill(counts, 1);
        recorder.dispatch_indirect(rows_kernel(), {a, b}, kRows, counts);
        recorder.fill(counts, 0);
    });
    CHECK(counted->rounds() == 3);
}

TEST_CASE("independent recordings share a command buffer as long as all of them are there") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    const Words one{1, 2, 3, 4}, other{5, 6, 7, 8};
    const Buffer a = device.upload(one.data(), sizeof one),
                 b = device.upload(other.data(), sizeof other);
    const Buffer c = words(device), d = words(device), e = words(device);
    auto a_to_c = record_copy(device, a, c), b_to_d = record_copy(device, b, d),
         c_to_e = record_copy(device, c, e);
    const VkCommandBuffer joint = device.joint({a_to_c.get(), b_to_d.get()});
    CHECK(joint == device.joint({a_to_c.get(), b_to_d.get()}));
    CHECK(joint != device.joint({b_to_d.get(), a_to_c.get()}));

    Queue queue(device);
    queue.run(*a_to_c);
    queue.run(*b_to_d);
    queue.run(*c_to_e);
    CHECK(read_back(queue, c) == one);
    CHECK(read_back(queue, d) == other);
    CHECK(read_back(queue, e) == one);

    // The next recording may lie where the one before it was.
    device.settle();
    a_to_c.reset();
    a_to_c = record_copy(device, b, c);
    queue.run(*a_to_c);
    queue.run(*b_to_d);
    queue.run(*c_to_e);
    CHECK(read_back(queue, e) == other);
}
