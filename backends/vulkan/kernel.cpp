// Class Kernel of logical_device.hpp.
#include <algorithm>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/logical_device.hpp"

namespace defrec::vulkan {
namespace {

// One more than the largest binding that a variable of the shader is decorated with.
uint32_t count_bindings(std::span<const uint32_t> code) {
    constexpr size_t kHeaderWords = 5;
    constexpr uint32_t kOpDecorate = 71, kDecorationBinding = 33;
    uint32_t count = 0;
    for (size_t i = kHeaderWords; i < code.size() && code[i] >> 16 != 0; i += code[i] >> 16)
        if ((code[i] & 0xffff) == kOpDecorate && code[i] >> 16 >= 4 &&
            code[i + 2] == kDecorationBinding)
            count = std::max(count, code[i + 3] + 1);
    return count;
}

}  // namespace

Kernel::Kernel(const LogicalDevice& device, const Shader& shader, std::vector<uint32_t> constants,
               const Rewrite& rewrite)
    : device_(device), name_(shader.name) {
    const VolkDeviceTable& vk = device.vk();
    const std::vector<uint32_t> rewritten = rewrite ? rewrite(shader) : std::vector<uint32_t>();
    const std::span<const uint32_t> code =
        rewrite ? std::span<const uint32_t>(rewritten) : shader.code;
    bindings_ = count_bindings(code);
    std::vector<VkDescriptorSetLayoutBinding> bindings(bindings_);
    for (uint32_t i = 0; i < bindings_; ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT,
                       nullptr};
    VkDescriptorSetLayoutCreateInfo set_info{};
    set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    set_info.bindingCount = bindings_;
    set_info.pBindings = bindings.data();
    const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushBytes};
    VkPipelineLayoutCreateInfo layout_info{};
    layout_info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    layout_info.setLayoutCount = 1;
    layout_info.pSetLayouts = &set_layout_;
    layout_info.pushConstantRangeCount = 1;
    layout_info.pPushConstantRanges = &push;
    VkShaderModuleCreateInfo module_info{};
    module_info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    module_info.codeSize = code.size_bytes();
    module_info.pCode = code.data();

    std::vector<VkSpecializationMapEntry> entries(constants.size());
    for (uint32_t i = 0; i < entries.size(); ++i)
        entries[i] = {i, uint32_t(i * sizeof(uint32_t)), sizeof(uint32_t)};
    const VkSpecializationInfo specialization{uint32_t(entries.size()), entries.data(),
                                              constants.size() * sizeof(uint32_t),
                                              constants.data()};
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = &specialization;
    try {
        check(vk.vkCreateDescriptorSetLayout(device.handle(), &set_info, nullptr, &set_layout_),
              "vkCreateDescriptorSetLayout");
        check(vk.vkCreatePipelineLayout(device.handle(), &layout_info, nullptr, &layout_),
              "vkCreatePipelineLayout");
        check(vk.vkCreateShaderModule(device.handle(), &module_info, nullptr, &info.stage.module),
              "vkCreateShaderModule");
        info.layout = layout_;
        const VkResult result = vk.vkCreateComputePipelines(
            device.handle(), device.pipeline_cache(), 1, &info, nullptr, &pipeline_);
        vk.vkDestroyShaderModule(device.handle(), info.stage.module, nullptr);
        check(result, "vkCreateComputePipelines");
    } catch (...) {
        destroy();
        throw;
    }
}

Kernel::~Kernel() { destroy(); }

void Kernel::destroy() {
    const VolkDeviceTable& vk = device_.vk();
    vk.vkDestroyPipeline(device_.handle(), pipeline_, nullptr);
    vk.vkDestroyPipelineLayout(device_.handle(), layout_, nullptr);
    vk.vkDestroyDescriptorSetLayout(device_.handle(), set_layout_, nullptr);
}

}  // namespace defrec::vulkan
