// What a queue does when reads are forgotten, and when the device's calls fail: the failures are
// put in place of the device's functions.
#include "backends/vulkan/queue.hpp"

#include <doctest/doctest.h>

#include <array>

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

TEST_CASE("memory that is not to be had leaves the device as it was") {
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
