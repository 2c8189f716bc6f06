/* Tests of the parts that need no server: `make test`. */

#include "plugin.c"

#undef NDEBUG
#include <assert.h>

static BusbarSample last;
static size_t calls;

static size_t take(void *context, const BusbarSample *samples, size_t count) {
    (void)context;
    last = samples[count - 1];
    calls++;
    return count;
}

static BusbarStr text(const char *literal) {
    return (BusbarStr){(const uint8_t *)literal, strlen(literal)};
}

static void lines_become_samples(void) {
    BusbarSampleSink sink = {.struct_size = sizeof sink, .publish = take};
    Tag tags[] = {
        {1, BUSBAR_VALUE_KIND_F64, "oil"},
        {2, BUSBAR_VALUE_KIND_BOOL, "alarm"},
        {3, BUSBAR_VALUE_KIND_TEXT, "mode"},
    };
    Instance self = {.sink = &sink, .tags = tags, .tag_count = 3};
    char good[] = "oil 61.5", wrong[] = "alarm maybe", unknown[] = "nobody 1", short_line[] = "oil";
    char mode[] = "mode hand held";
    read_line(&self, mode);
    assert(last.tag == 3 && last.kind == BUSBAR_VALUE_KIND_TEXT);
    assert(last.text.len == strlen("hand held"));
    assert(memcmp(last.text.ptr, "hand held", last.text.len) == 0);
    read_line(&self, good);
    assert(last.tag == 1 && last.number == 61.5 && last.quality == BUSBAR_QUALITY_GOOD);
    read_line(&self, wrong);
    assert(last.tag == 2 && last.quality == BUSBAR_QUALITY_BAD);
    read_line(&self, unknown);
    read_line(&self, short_line);
    assert(calls == 3);
}

static void settings_and_addresses_are_read(void) {
    char host[MAX_ADDRESS], port[MAX_ADDRESS];
    assert(parse_settings(text(" { \"address\" : \"127.0.0.1:7070\" }"), host, port));
    assert(strcmp(host, "127.0.0.1") == 0 && strcmp(port, "7070") == 0);
    assert(!parse_settings(text("{}"), host, port));
    assert(!parse_settings(text("{\"address\": \"no port\"}"), host, port));
    BusbarError error = {.struct_size = sizeof error};
    BusbarTagSpec spec = {.kind = BUSBAR_VALUE_KIND_F64, .id = TEXT("T1.Oil")};
    spec.address_json = text("\"oil\"");
    assert(parse_tags(&spec, 1, NULL, &error) == BUSBAR_OK);
    spec.kind = BUSBAR_VALUE_KIND_TEXT;
    assert(parse_tags(&spec, 1, NULL, &error) == BUSBAR_OK);
    spec.kind++;
    assert(parse_tags(&spec, 1, NULL, &error) == BUSBAR_INVALID_ARGUMENT);
    spec.kind = BUSBAR_VALUE_KIND_F64;
    spec.address_json = text("7");
    assert(parse_tags(&spec, 1, NULL, &error) == BUSBAR_INVALID_SETTINGS);
    assert(error.message_len > 0);
}

int main(void) {
    lines_become_samples();
    settings_and_addresses_are_read();
    puts("2 tests passed");
    return 0;
}
