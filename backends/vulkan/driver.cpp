// See driver.hpp.
#include "backends/vulkan/driver.hpp"

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <string_view>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

#include "backends/vulkan/system.hpp"

namespace defrec::vulkan {
namespace {

std::string version_text(uint32_t version) {
    return std::to_string(VK_API_VERSION_MAJOR(version)) + "." +
           std::to_string(VK_API_VERSION_MINOR(version)) + "." +
           std::to_string(VK_API_VERSION_PATCH(version));
}

// Compute without graphics where there is such a family: work there does not wait for a display.
bool find_queue_family(VkPhysicalDevice device, uint32_t& family, uint32_t& count) {
    uint32_t number = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &number, nullptr);
    std::vector<VkQueueFamilyProperties> families(number);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &number, families.data());
    bool found = false;
    for (uint32_t i = 0; i < number; ++i) {
        if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) continue;
        const bool only_compute = (families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT) == 0;
        if (found && !only_compute) continue;
        family = i;
        count = families[i].queueCount;
        found = true;
        if (only_compute) break;
    }
    return found;
}

std::string missing_features(VkPhysicalDevice device,
                             const VkPhysicalDeviceProperties& properties) {
    if (properties.apiVersion < VK_API_VERSION_1_2)
        return "Vulkan 1.2 (it has " + version_text(properties.apiVersion) + ")";
    VkPhysicalDeviceVulkan12Features v12{};
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    VkPhysicalDeviceVulkan11Features v11{};
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    v11.pNext = &v12;
    VkPhysicalDeviceFeatures2 features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features.pNext = &v11;
    vkGetPhysicalDeviceFeatures2(device, &features);
    if (!v12.timelineSemaphore) return "timeline semaphores";
    if (!v12.storageBuffer8BitAccess) return "8 bit access to storage buffers";
    if (!v11.storageBuffer16BitAccess) return "16 bit access to storage buffers";
    if (!features.features.shaderInt64) return "64 bit integers in shaders";
    if (properties.limits.maxComputeSharedMemorySize < 32768) return "32 KiB of shared memory";
    if (properties.limits.maxComputeWorkGroupInvocations < 1024 ||
        properties.limits.maxComputeWorkGroupSize[0] < 1024)
        return "work groups of 1024 invocations";
    if (properties.limits.maxPerStageDescriptorStorageBuffers < 16)
        return "16 storage buffers in one shader";
    return {};
}

// Asks a device that lacks nothing: others may not know the call.
bool has_packed_dot(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
    if (std::none_of(extensions.begin(), extensions.end(), [](const auto& extension) {
            return std::string_view(extension.extensionName) ==
                   VK_KHR_SHADER_INTEGER_DOT_PRODUCT_EXTENSION_NAME;
        }))
        return false;
    VkPhysicalDeviceShaderIntegerDotProductFeatures dot{};
    dot.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_INTEGER_DOT_PRODUCT_FEATURES;
    VkPhysicalDeviceFeatures2 features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features.pNext = &dot;
    vkGetPhysicalDeviceFeatures2(device, &features);
    return dot.shaderIntegerDotProduct == VK_TRUE;
}

// Mesa's drivers keep what they find out about an AMD CPU here until the process ends, also when
// the loader unloads them: LeakSanitizer would report it.
VkResult enumerate(VkInstance instance, uint32_t& count, VkPhysicalDevice* handles) {
#ifdef __SANITIZE_ADDRESS__
    const __lsan::ScopedDisabler not_ours;
#endif
    return vkEnumeratePhysicalDevices(instance, &count, handles);
}

PhysicalDevice describe(VkPhysicalDevice handle) {
    VkPhysicalDeviceDriverProperties driver{};
    driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
    VkPhysicalDeviceProperties2 two{};
    two.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    two.pNext = &driver;
    vkGetPhysicalDeviceProperties2(handle, &two);
    const VkPhysicalDeviceProperties& properties = two.properties;
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(handle, &memory);

    PhysicalDevice device{};
    device.handle = handle;
    char id[32];
    std::snprintf(id, sizeof id, "vulkan:%04x:%04x", properties.vendorID, properties.deviceID);
    device.id = id;
    device.name = properties.deviceName;
    device.driver = std::string(driver.driverName) + " " + driver.driverInfo + ", Vulkan " +
                    version_text(properties.apiVersion);
    for (uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if ((memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0)
            device.memory_bytes =
                std::max<uint64_t>(device.memory_bytes, memory.memoryHeaps[i].size);
    device.software = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    device.lacks = missing_features(handle, properties);
    if (!find_queue_family(handle, device.queue_family, device.queue_count))
        device.lacks = "a queue that computes";
    device.packed_dot = device.lacks.empty() && has_packed_dot(handle);
    return device;
}

}  // namespace

std::shared_ptr<const Driver> Driver::open() {
    // volk's table is the process's. Its functions are the loader's own, which serve every
    // instance, so it is filled once.
    static std::mutex mutex;
    static bool instance_functions = false;
    const std::lock_guard lock(mutex);
    static const VkResult loaded = load_loader();
    if (loaded != VK_SUCCESS || volkGetInstanceVersion() < VK_API_VERSION_1_2) return nullptr;
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.pApplicationName = "defrec";
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    VkInstance instance = VK_NULL_HANDLE;
    if (vkCreateInstance(&info, nullptr, &instance) != VK_SUCCESS) return nullptr;
    if (!instance_functions) volkLoadInstanceOnly(instance);
    instance_functions = true;
    const std::shared_ptr<Driver> driver(new Driver(instance));
    driver->find_devices();
    return driver;
}

void Driver::find_devices() {
    uint32_t count = 0;
    enumerate(instance_, count, nullptr);
    std::vector<VkPhysicalDevice> handles(count);
    if (enumerate(instance_, count, handles.data()) != VK_SUCCESS) return;
    for (VkPhysicalDevice handle : handles) {
        PhysicalDevice device = describe(handle);
        const auto alike =
            std::count_if(devices_.begin(), devices_.end(), [&](const PhysicalDevice& other) {
                return other.id.compare(0, device.id.size(), device.id) == 0;
            });
        if (alike != 0) device.id.append(":").append(std::to_string(alike));
        devices_.push_back(std::move(device));
    }
}

Driver::~Driver() { vkDestroyInstance(instance_, nullptr); }

}  // namespace defrec::vulkan
