/* Lists the devices of this machine, and the plugins that were refused, with the reason.
 *   list_devices */
#include <inttypes.h>
#include <stdio.h>

#include "input.h"

static const char* kind_name(uint32_t kind) {
    switch (kind) {
        case DEFREC_DEVICE_CPU:
            return "CPU";
        case DEFREC_DEVICE_CUDA:
            return "CUDA";
        case DEFREC_DEVICE_VULKAN:
            return "Vulkan";
        default:
            return "unknown";
    }
}

static int count_bits(uint32_t mask) {
    int count = 0;
    for (; mask != 0; mask &= mask - 1) ++count;
    return count;
}

int main(void) {
    defrec_context context;
    size_t i;
    /* NULL: the plugins beside the library */
    check(defrec_context_create(NULL, &context), "loading the plugins");
    printf("defrec %s, API %u.%u\n", defrec_version_string(), defrec_version() / 1000,
           defrec_version() % 1000);

    for (i = 0; i < defrec_device_count(context); ++i) {
        defrec_device_info device;
        DEFREC_INIT(&device);
        check(defrec_device_get(context, i, &device), "reading a device");
        printf("device %s: %s (%s), driver %s, %" PRIu64 " MiB, %d of %d stages, ", device.id,
               device.name, kind_name(device.kind),
               device.driver[0] == '\0' ? "none" : device.driver, device.memory_bytes >> 20,
               count_bits(device.stages), DEFREC_STAGE_COUNT_V1);
        if (device.conformance != 0)
            printf("conformance suite %u passed\n", device.conformance);
        else
            printf("no conformance certified\n");
    }
    for (i = 0; i < defrec_plugin_count(context); ++i) {
        defrec_plugin_info plugin;
        DEFREC_INIT(&plugin);
        check(defrec_plugin_get(context, i, &plugin), "reading a plugin");
        if (plugin.verdict < 0) printf("refused %s: %s\n", plugin.path, plugin.reason);
    }
    defrec_context_destroy(context);
    return 0;
}
