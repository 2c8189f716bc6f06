/* What every plugin in C needs: texts, errors, and arguments that are checked. */

#ifndef SUPPORT_H
#define SUPPORT_H

#include <busbar/plugin.h>

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* A BusbarStr of a literal. */
#define TEXT(literal) {(const uint8_t *)(literal), sizeof(literal) - 1}
/* Whether a struct of the header was passed: there, aligned, and long enough. */
#define GIVEN(pointer, type) is_given((pointer), sizeof(type), _Alignof(type))
/* Whether an array was passed: there and aligned, or empty. */
#define GIVEN_ARRAY(pointer, count, type) \
    ((count) == 0 || ((pointer) != NULL && (uintptr_t)(pointer) % _Alignof(type) == 0))

static inline int is_given(const void *pointer, size_t size, size_t alignment) {
    uint32_t struct_size;
    if (pointer == NULL || (uintptr_t)pointer % alignment != 0) {
        return 0;
    }
    memcpy(&struct_size, pointer, sizeof struct_size);
    return struct_size >= size;
}

static inline int same_text(BusbarStr text, const char *literal) {
    size_t len = strlen(literal);
    return text.len == len && text.ptr != NULL && memcmp(text.ptr, literal, len) == 0;
}

/* Where a text of at most `most` bytes can be cut without cutting a character. */
static inline size_t cut(const uint8_t *text, size_t len, size_t most) {
    if (len <= most) {
        return len;
    }
    while (most > 0 && (text[most] & 0xc0) == 0x80) {
        most--;
    }
    return most;
}

/* Writes a reason into the caller's error, if there is room for one; the status. */
static inline BusbarStatus fail(BusbarError *error, BusbarStatus status, const char *format, ...) {
    if (GIVEN(error, BusbarError)) {
        char text[2 * BUSBAR_ERROR_CAPACITY];
        va_list arguments;
        va_start(arguments, format);
        int len = vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        size_t size = len < 0 ? 0 : (size_t)len < sizeof text ? (size_t)len : sizeof text - 1;
        error->message_len = (uint32_t)cut((const uint8_t *)text, size, sizeof error->message);
        memcpy(error->message, text, error->message_len);
        error->status = status;
    }
    return status;
}

/* Reads a JSON string without escapes at `*at`, and moves behind it; 0 if it is none or
 * does not fit. `into` is terminated. */
static inline int read_string(BusbarStr json, size_t *at, char *into, size_t room) {
    size_t from = *at, to;
    if (from >= json.len || json.ptr[from] != '"') {
        return 0;
    }
    for (to = ++from; to < json.len && json.ptr[to] != '"'; to++) {
        if (json.ptr[to] < ' ' || json.ptr[to] == '\\') {
            return 0;
        }
    }
    if (to >= json.len || to - from >= room) {
        return 0;
    }
    memcpy(into, json.ptr + from, to - from);
    into[to - from] = '\0';
    *at = to + 1;
    return 1;
}

static inline void skip_space(BusbarStr json, size_t *at) {
    while (*at < json.len && json.ptr[*at] != 0 && strchr(" \t\r\n", json.ptr[*at]) != NULL) {
        (*at)++;
    }
}

#endif
