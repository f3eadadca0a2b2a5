// See shared_device.hpp.
#include "backends/vulkan/shared_device.hpp"

#include <map>
#include <mutex>
#include <new>

#include "backends/vulkan/device.hpp"
#include "backends/vulkan/known_answer.hpp"
#include "backends/vulkan/system.hpp"

namespace defrec::vulkan {
namespace {

struct Shared {
    std::mutex mutex;
    std::weak_ptr<const Driver> driver;
    std::map<size_t, std::weak_ptr<LogicalDevice>> devices;
};

Shared& shared() {
    static Shared result;
    // A child cannot use what its parent opened, nor destroy it, and the mutex may be locked.
    static std::once_flag registered;
    std::call_once(registered, call_in_forked_child, [] { new (&shared()) Shared; });
    return result;
}

}  // namespace

std::shared_ptr<const Driver> shared_driver() {
    Shared& known = shared();
    const std::lock_guard lock(known.mutex);
    std::shared_ptr<const Driver> driver = known.driver.lock();
    if (driver == nullptr) known.driver = driver = Driver::open();
    return driver;
}

std::shared_ptr<LogicalDevice> shared_device(const std::shared_ptr<const Driver>& driver,
                                             size_t index) {
    Shared& known = shared();
    const std::lock_guard lock(known.mutex);
    std::weak_ptr<LogicalDevice>& place = known.devices[index];
    std::shared_ptr<LogicalDevice> device = place.lock();
    if (device == nullptr || device->lost() || device->driver() != driver) {
        device = std::make_shared<LogicalDevice>(driver, index);
        Device probe(device);
        check_known_answers(probe);
        place = device;
    }
    return device;
}

}  // namespace defrec::vulkan
