// What a queue does when reads are forgotten, and when the device's calls fail: the failures are
// put in place of the device's functions.
#include "backends/vulkan/queue.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <memory>

#include "backends/vulkan/test_device.hpp"
#include "backends/vulkan/test_replaced.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

VKAPI_ATTR VkResult VKAPI_CALL no_submission(VkQueue, uint32_t, const VkSubmitInfo*, VkFence) {
    return VK_ERROR_OUT_OF_HOST_MEMORY;
}
VKAPI_ATTR VkResult VKAPI_CALL no_end(VkCommandBuffer) { return VK_ERROR_OUT_OF_DEVICE_MEMORY; }
VKAPI_ATTR VkResult VKAPI_CALL no_memory(VkDevice, const VkMemoryAllocateInfo*,
                                         const VkAllocationCallbacks*, VkDeviceMemory*) {
    return VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

using Words = std::array<uint32_t, 4>;
constexpr Words kUntouched{7, 7, 7, 7}, kWritten{1, 2, 3, 4};

}  // namespace

TEST_CASE("reads of a submission that failed are never delivered") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    const Buffer buffer = device.upload(kWritten.data(), sizeof kWritten);
    Queue queue(device);
    Words lost = kUntouched, read = kUntouched;
    queue.read(buffer, 0, lost.data(), sizeof lost);
    SUBCASE("it is not taken") {
        const Replaced replaced(device, &VolkDeviceTable::vkQueueSubmit, no_submission);
        CHECK(status_of([&] { queue.signal(); }) == DEFREC_ERROR_OUT_OF_MEMORY);
    }
    SUBCASE("its commands cannot be ended") {
        const Replaced replaced(device, &VolkDeviceTable::vkEndCommandBuffer, no_end);
        CHECK(status_of([&] { queue.signal(); }) == DEFREC_ERROR_OUT_OF_MEMORY);
    }
    SUBCASE("it is not taken when another thread settles the device") {
        {
            const Replaced replaced(device, &VolkDeviceTable::vkQueueSubmit, no_submission);
            device.settle();
        }
        queue.read(buffer, 0, lost.data(), sizeof lost);
        CHECK(status_of([&] { queue.signal(); }) == DEFREC_ERROR_OUT_OF_MEMORY);
    }
    queue.read(buffer, 0, read.data(), sizeof read);
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(lost == kUntouched);
    CHECK(read == kWritten);
}

TEST_CASE("a read that is forgotten leaves its destination as it is, and others are delivered") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    const Buffer buffer = device.upload(kWritten.data(), sizeof kWritten);
    Queue queue(device);
    Words forgotten = kUntouched, read = kUntouched;
    queue.read(buffer, 0, forgotten.data(), sizeof forgotten);
    queue.read(buffer, 0, read.data(), sizeof read);
    SUBCASE("before it is submitted") { queue.forget_read(forgotten.data()); }
    SUBCASE("after") {
        queue.signal();
        queue.forget_read(forgotten.data());
    }
    CHECK(queue.wait(queue.signal(), UINT64_MAX));
    CHECK(forgotten == kUntouched);
    CHECK(read == kWritten);
}

TEST_CASE("contents of a buffer that cannot be had leave nothing to deliver") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    const Buffer buffer = device.upload(kWritten.data(), sizeof kWritten);
    Queue queue(device);
    Words before = kUntouched;
    queue.read(buffer, 0, before.data(), sizeof before);
    const uint64_t value = queue.signal();
    {
        const Replaced replaced(device, &VolkDeviceTable::vkQueueSubmit, no_submission);
        CHECK(status_of([&] { contents(queue, buffer); }) == DEFREC_ERROR_OUT_OF_MEMORY);
    }
    CHECK(contents(queue, buffer).size() == sizeof kWritten);
    // Others' reads stay.
    CHECK(queue.wait(value, UINT64_MAX));
    CHECK(before == kWritten);
}

TEST_CASE("row 45: memory that is not to be had leaves the device as it was") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    {
        const Replaced replaced(device, &VolkDeviceTable::vkAllocateMemory, no_memory);
        CHECK(status_of([&] { Buffer(device, 64 << 20); }) == DEFREC_ERROR_OUT_OF_MEMORY);
    }
    const Buffer buffer = device.upload(kWritten.data(), sizeof kWritten);
    Queue queue(device);
    CHECK(contents(queue, buffer).size() == sizeof kWritten);
}

TEST_CASE("memory of the host is read and written where it lies") {
    if (!under_test::available()) return;
    Device device(under_test::new_logical_device());
    constexpr uint64_t kSize = 3 * sizeof(Words);
    struct Release {
        Device& device;
        void operator()(void* memory) const { device.release_host(memory); }
    };
    const std::unique_ptr<void, Release> memory(device.allocate_host(kSize), {device});
    CHECK(reinterpret_cast<uintptr_t>(memory.get()) % 64 == 0);
    auto* words = static_cast<Words*>(memory.get());
    CHECK(std::all_of(words, words + 3, [](const Words& w) { return w == Words{}; }));
    CHECK(device.find_host(words + 1, 2 * sizeof(Words)).offset == sizeof(Words));
    CHECK(device.find_host(words + 1, 2 * sizeof(Words) + 1).buffer == nullptr);
    CHECK(device.find_host(words + 3, 1).buffer == nullptr);

    const Buffer buffer(device, 2 * sizeof(Words));
    Queue queue(device);
    words[0] = kUntouched;
    queue.write_in_place(buffer, 0, &words[0], sizeof(Words));
    queue.write_in_place(buffer, sizeof(Words), kWritten.data(), sizeof(Words));
    words[0] = kWritten;  // what the device reads
    SUBCASE("one after another where they have something in common") {
        queue.read(buffer, sizeof(Words), &words[1], sizeof(Words));
        queue.write_in_place(buffer, sizeof(Words), &words[0], sizeof(Words));
        queue.read(buffer, 0, &words[2], sizeof(Words));
        queue.read(buffer, sizeof(Words), &words[2], sizeof(Words));
    }
    SUBCASE("without a wait for the host to deliver them") {
        queue.read(buffer, 0, &words[1], sizeof(Words));
        queue.read(buffer, sizeof(Words), &words[2], sizeof(Words));
    }
    device.settle();
    CHECK(words[1] == kWritten);
    CHECK(words[2] == kWritten);
}
