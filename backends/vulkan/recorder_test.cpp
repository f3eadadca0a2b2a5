// Recordings that have nothing in common run beside each other; whatever else happens, each sees
// what those before it wrote.
#include "backends/vulkan/recorder.hpp"

#include <doctest/doctest.h>

#include <array>
#include <memory>

#include "backends/vulkan/queue.hpp"
#include "backends/vulkan/test_device.hpp"
#include "shaders.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

using Words = std::array<uint32_t, 4>;

std::unique_ptr<Recording> record_copy(Device& device, const Buffer& from, const Buffer& to) {
    auto recording = std::make_unique<Recording>(device);
    Recorder recorder(*recording);
    recorder.copy(from, to, sizeof(Words));
    recorder.finish();
    return recording;
}
std::unique_ptr<Recording> record_rows(Device& device, const Buffer& state, const Buffer& next) {
    struct {
        int32_t width = 4, height = 4, unused[8] = {};
    } push;
    auto recording = std::make_unique<Recording>(device);
    Recorder recorder(*recording);
    recorder.dispatch(device.kernel(shaders::rectify_mask), {state, next}, push, {1, 1});
    recorder.finish();
    return recording;
}
Words read_back(Queue& queue, const Buffer& buffer) {
    Words words{};
    queue.read(buffer, 0, words.data(), sizeof words);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    return words;
}

}  // namespace

TEST_CASE("recordings are independent where neither writes what the other touches") {
    if (!under_test::available()) return;
    Device& device = under_test::device();
    const Buffer a(device, sizeof(Words)), b(device, sizeof(Words)), c(device, sizeof(Words));
    const auto a_to_b = record_copy(device, a, b), a_to_c = record_copy(device, a, c),
               b_to_a = record_copy(device, b, a), c_to_b = record_copy(device, c, b);
    CHECK(a_to_b->independent(*a_to_c));
    CHECK_FALSE(a_to_b->independent(*b_to_a));
    CHECK_FALSE(a_to_b->independent(*c_to_b));  // both write b
    CHECK_FALSE(a_to_c->independent(*c_to_b));
    CHECK_FALSE(c_to_b->independent(*a_to_c));

    // What a shader only reads is none of what it writes.
    const auto rows_a_to_b = record_rows(device, a, b), rows_a_to_c = record_rows(device, a, c),
               rows_c_to_a = record_rows(device, c, a);
    CHECK(rows_a_to_b->independent(*rows_a_to_c));
    CHECK_FALSE(rows_a_to_b->independent(*rows_c_to_a));
    CHECK_FALSE(rows_a_to_b->independent(*b_to_a));
}

TEST_CASE("independent recordings share a command buffer as long as all of them are there") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    const Words one{1, 2, 3, 4}, other{5, 6, 7, 8};
    const Buffer a = device.upload(one.data(), sizeof one),
                 b = device.upload(other.data(), sizeof other);
    const Buffer c(device, sizeof(Words)), d(device, sizeof(Words)), e(device, sizeof(Words));
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
