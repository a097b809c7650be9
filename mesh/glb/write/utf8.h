/* mesh/glb/write/utf8.h: names that may not be UTF-8, which JSON demands. */
#ifndef FCT_MESH_GLB_UTF8_H
#define FCT_MESH_GLB_UTF8_H

/* Bytes of the character of UTF-8 at p, which ends with a zero byte; 0 if there is none. */
static inline int fct_utf8_length(const unsigned char *p) {
    int length = *p < 0x80                 ? 1
                 : *p >= 0xc2 && *p < 0xe0 ? 2
                 : *p >= 0xe0 && *p < 0xf0 ? 3
                 : *p >= 0xf0 && *p < 0xf5 ? 4
                                           : 0;
    for (int k = 1; k < length; ++k)
        if ((p[k] & 0xc0) != 0x80) return 0;
    if (length == 3 && ((*p == 0xe0 && p[1] < 0xa0) || (*p == 0xed && p[1] > 0x9f))) return 0;
    if (length == 4 && ((*p == 0xf0 && p[1] < 0x90) || (*p == 0xf4 && p[1] > 0x8f))) return 0;
    return length;
}

#endif
