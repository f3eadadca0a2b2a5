// Failures of a device's functions, put in their place.
#pragma once
#include "backends/vulkan/device.hpp"

namespace defrec::vulkan {

// One of a device's functions replaced while it lives.
template <class Function>
class Replaced {
  public:
    Replaced(const Device& device, Function VolkDeviceTable::*member, Function by)
        : place_(const_cast<VolkDeviceTable&>(device.vk()).*member), real_(place_) {
        place_ = by;
    }
    ~Replaced() { place_ = real_; }
    Replaced(const Replaced&) = delete;
    Replaced& operator=(const Replaced&) = delete;

  private:
    Function& place_;
    Function real_;
};

defrec_status status_of(const auto& call) {
    try {
        call();
    } catch (const StageError& error) {
        return error.status();
    }
    return DEFREC_OK;
}

}  // namespace defrec::vulkan
