// Counts the loop iterations of shaders' invocations, by SPIR-V that counts along.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "backends/vulkan/device.hpp"

namespace defrec::vulkan::test {

// For a device of its own, from before its first kernel.
class LoopCounter {
  public:
    explicit LoopCounter(Device& device);
    // By shader: the most iterations of one invocation in one dispatch so far, all its loops added.
    // The device must be idle.
    std::map<std::string, uint32_t> max_iterations();

  private:
    std::vector<uint32_t> counting(const Shader& shader);
    Device& device_;
    std::vector<std::string> shaders_;  // by slot
};

}  // namespace defrec::vulkan::test
