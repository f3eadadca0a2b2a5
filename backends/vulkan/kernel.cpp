// Class Kernel of logical_device.hpp.
#include <map>
#include <set>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/logical_device.hpp"

namespace defrec::vulkan {
namespace {

// For each binding whether the shader may write there. readonly is said of the members of a
// variable's struct.
std::vector<bool> written_bindings(std::span<const uint32_t> code) {
    constexpr size_t kHeaderWords = 5;
    constexpr uint32_t kOpTypePointer = 32, kOpVariable = 59, kOpDecorate = 71,
                       kOpMemberDecorate = 72, kNonWritable = 24, kBinding = 33;
    std::map<uint32_t, uint32_t> binding_of, pointee, type_of;  // by variable, pointer, variable
    std::set<uint32_t> read_only;                               // structs and variables
    for (size_t i = kHeaderWords; i < code.size() && code[i] >> 16 != 0; i += code[i] >> 16) {
        const uint32_t operation = code[i] & 0xffff, words = code[i] >> 16;
        if (operation == kOpDecorate && words >= 4 && code[i + 2] == kBinding)
            binding_of[code[i + 1]] = code[i + 3];
        if (operation == kOpDecorate && code[i + 2] == kNonWritable) read_only.insert(code[i + 1]);
        if (operation == kOpMemberDecorate && code[i + 3] == kNonWritable)
            read_only.insert(code[i + 1]);
        if (operation == kOpTypePointer) pointee[code[i + 1]] = code[i + 3];
        if (operation == kOpVariable) type_of[code[i + 2]] = code[i + 1];
    }
    std::vector<bool> written;
    for (const auto& [variable, binding] : binding_of) {
        if (binding >= written.size()) written.resize(binding + 1, false);
        if (!read_only.contains(variable) && !read_only.contains(pointee[type_of[variable]]))
            written[binding] = true;
    }
    return written;
}

}  // namespace

Kernel::Kernel(const LogicalDevice& device, const Shader& shader, std::vector<uint32_t> constants,
               const Rewrite& rewrite)
    : device_(device), name_(shader.name) {
    const VolkDeviceTable& vk = device.vk();
    const std::vector<uint32_t> rewritten = rewrite ? rewrite(shader) : std::vector<uint32_t>();
    const std::span<const uint32_t> code =
        rewrite ? std::span<const uint32_t>(rewritten) : shader.code;
    written_ = written_bindings(code);
    std::vector<VkDescriptorSetLayoutBinding> bindings(written_.size());
    for (uint32_t i = 0; i < bindings.size(); ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT,
                       nullptr};
    VkDescriptorSetLayoutCreateInfo set_info{};
    set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    set_info.bindingCount = uint32_t(bindings.size());
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
