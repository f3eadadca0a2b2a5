// All contexts of a process share a logical device: how long it lives, whose work waits for whose,
// and what its loss means.
#include "backends/vulkan/shared_device.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <thread>

#include "backends/vulkan/test_device.hpp"
#include "backends/vulkan/test_replaced.hpp"
#include "shaders.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

using Words = std::array<uint32_t, 64>;

VKAPI_ATTR VkResult VKAPI_CALL lost_submission(VkQueue, uint32_t, const VkSubmitInfo*, VkFence) {
    return VK_ERROR_DEVICE_LOST;
}

std::shared_ptr<LogicalDevice> shared_one() {
    return shared_device(shared_driver(), under_test::device_index());
}

Words read_back(Queue& queue, const Buffer& buffer) {
    Words result{};
    queue.read(buffer, 0, result.data(), sizeof result);
    queue.wait(queue.signal(), UINT64_MAX);
    return result;
}

}  // namespace

TEST_CASE("who opens a device that is open gets the same, and pipelines that are made") {
    if (!under_test::available()) return;
    std::weak_ptr<LogicalDevice> seen;
    {
        Device one(shared_one()), other(shared_one());
        CHECK(&one.logical() == &other.logical());
        CHECK(one.kernel(shaders::rectify_mask) == other.kernel(shaders::rectify_mask));
        CHECK(&one.memory() != &other.memory());
        seen = shared_one();
    }
    CHECK(seen.expired());
}

TEST_CASE("queues are spread over those of the device") {
    if (!under_test::available()) return;
    const std::shared_ptr<LogicalDevice> device = shared_one();
    LogicalDevice::HardwareQueue &first = device->acquire_queue(),
                                 &second = device->acquire_queue();
    const size_t most = std::max(first.users, second.users);
    const bool several = &first != &second;
    CHECK(most == (several ? 1 : 2));
    device->release_queue(first);
    LogicalDevice::HardwareQueue& third = device->acquire_queue();
    CHECK(third.users == (several ? 1 : 2));
    device->release_queue(second);
    device->release_queue(third);
    CHECK(first.users + second.users + third.users == 0);
}

TEST_CASE("32 users in 8 threads at once, each with its own memory, queue and results") {
    if (!under_test::available()) return;
    constexpr uint32_t kThreads = 8, kUsersEach = 4, kRuns = 20;
    std::array<uint32_t, kThreads> wrong{};
    std::vector<std::thread> threads;
    for (uint32_t t = 0; t < kThreads; ++t)
        threads.emplace_back([&, t] {
            for (uint32_t user = 0; user < kUsersEach; ++user) {
                Device device(shared_one());
                const Buffer buffer(device, sizeof(Words)), copy(device, sizeof(Words));
                Recording recording(device);
                Recorder recorder(recording);
                recorder.copy(buffer, copy, sizeof(Words));
                recorder.finish();
                Queue queue(device);
                for (uint32_t i = 0; i < kRuns; ++i) {
                    Words words;
                    words.fill((t * kUsersEach + user) * kRuns + i);
                    queue.write(buffer, 0, words.data(), sizeof words);
                    queue.run(recording);
                    wrong[t] += read_back(queue, copy) != words;
                }
                device.settle();
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (uint32_t t = 0; t < kThreads; ++t) CHECK(wrong[t] == 0);
}

TEST_CASE("a loss is one for all users, and the next one opens another device") {
    if (!under_test::available()) return;
    Device one(shared_one()), other(shared_one());
    const Buffer of_one(one, sizeof(Words)), of_other(other, sizeof(Words));
    one.clear(of_one);
    other.clear(of_other);
    Queue queue_of_one(one), queue_of_other(other);
    Words read{};
    const uint64_t before =
        (queue_of_other.read(of_other, 0, read.data(), sizeof read), queue_of_other.signal());
    {
        const Replaced replaced(one, &VolkDeviceTable::vkQueueSubmit, lost_submission);
        CHECK(status_of([&] { queue_of_one.signal(); }) == DEFREC_ERROR_DEVICE_LOST);
    }
    CHECK(status_of([&] { queue_of_other.signal(); }) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(status_of([&] { other.clear(of_other); }) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(queue_of_other.wait(before, UINT64_MAX));

    Device next(shared_one());
    CHECK(&next.logical() != &one.logical());
    const Buffer buffer(next, sizeof(Words));
    next.clear(buffer);
    Queue queue(next);
    CHECK(read_back(queue, buffer) == Words{});
}
