/* Both public headers, used as a C or C++ program would; compiled in the tests as C99 and as C++,
 * every warning an error. */
#include "include/defrec_c.h"
#include "include/defrec_plugin.h"

typedef char api_is_one[DEFREC_API_MAJOR == 1 && DEFREC_PLUGIN_ABI_MAJOR == 1 ? 1 : -1];

int has_wait(const defrec_plugin* plugin);
int has_wait(const defrec_plugin* plugin) {
    return DEFREC_HAS(plugin, wait) && DEFREC_HAS(plugin, stage);
}

int main(void) {
    defrec_context_desc desc;
    defrec_context context = NULL;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.threads = 1;
    if (defrec_context_create(&desc, &context) != DEFREC_OK) return 1;
    if (defrec_device_count(context) != 0) return 2;
    defrec_context_destroy(context);
    if (defrec_rig_get(NULL, NULL) != DEFREC_ERROR_ARGUMENT) return 3;
    return defrec_version() / 1000 == DEFREC_API_MAJOR ? 0 : 4;
}
