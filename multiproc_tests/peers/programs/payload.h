/* What the C and C++ peers share: the command line, the octets of a Blob, and the hold at the end.  */
#ifndef PAYLOAD_H
#define PAYLOAD_H

#include <getopt.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum kind { SHAPE, PLAIN, OPEN, BLOB, KEYED_BLOB };

struct options {
  int domain, count, interval_ms, wait_s, linger_ms, size, depth, representation, blob_octets, readers;
  int lease_s, read_pause_ms, max_samples;
  int best_effort, is_volatile, dispose, unregister, keyless, appendable, gate, hold, unicast;
  const char *topic, *partitions, *address, *store, *name, *governance;
  char *colors[16];
  int color_count;
  int is_publisher;
};

/* One event, one line, at once.  */
static void say(const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  vprintf(format, arguments);
  va_end(arguments);
  putchar('\n');
  fflush(stdout);
}

static enum kind kind_of(const struct options *o)
{
  if (o->blob_octets >= 0)
    return o->keyless ? BLOB : KEYED_BLOB;
  if (o->appendable)
    return OPEN;
  return o->keyless ? PLAIN : SHAPE;
}

static void fill_blob(uint8_t *octets, size_t length, int32_t id)
{
  for (size_t j = 0; j < length; j++)
    octets[j] = (uint8_t) (31 * j + 7 * (j >> 8) + (size_t) id);
}

/* The CRC-32 of zlib and Ethernet.  */
static uint32_t crc32_of(const uint8_t *octets, size_t length)
{
  static uint32_t table[256];
  if (table[1] == 0)
    for (uint32_t n = 0; n < 256; n++) {
      uint32_t remainder = n;
      for (int bit = 0; bit < 8; bit++)
        remainder = remainder & 1 ? 0xEDB88320u ^ (remainder >> 1) : remainder >> 1;
      table[n] = remainder;
    }
  uint32_t crc = 0xFFFFFFFFu;
  for (size_t j = 0; j < length; j++)
    crc = table[(crc ^ octets[j]) & 0xFF] ^ (crc >> 8);
  return crc ^ 0xFFFFFFFFu;
}

/* Waits for a line, or the end, on standard input, and reads not an octet beyond it.  */
static void read_line(void)
{
  char octet;
  while (read(0, &octet, 1) == 1 && octet != '\n')
    continue;
}

/* Has something, or the end, come on standard input?  */
static int is_released(void)
{
  struct pollfd input = { 0, POLLIN, 0 };
  return poll(&input, 1, 0) > 0;
}

#define REVOCATION_LIST "identity_ca.crl.pem"

/* The keystore may hold a list of certificates that are taken back.  */
static inline int has_revocation_list(const struct options *o)
{
  char path[1024];
  snprintf(path, sizeof path, "%s/" REVOCATION_LIST, o->store);
  return access(path, R_OK) == 0;
}

/* With -G: does not begin to write before it is told to.  */
static void wait_at_gate(const struct options *o)
{
  if (o->gate)
    read_line();
}

static void leave_slowly(const struct options *o)
{
  if (o->hold) {
    say("HOLDING");
    read_line();
  } else
    usleep((useconds_t) o->linger_ms * 1000);
}

static int usage(const char *program)
{
  fprintf(stderr, "usage: %s [options] pub|sub, with the options of docs/multiproc.md\n", program);
  exit(64);
}

static struct options parse_options(int argc, char **argv)
{
  struct options o;
  memset(&o, 0, sizeof o);
  o.count = 10, o.interval_ms = 100, o.wait_s = 20, o.linger_ms = 500, o.size = 30;
  o.representation = 1, o.blob_octets = -1, o.readers = 1;
  o.topic = "Square", o.address = "127.0.0.1", o.name = "alice", o.governance = "governance.p7s";
  char *colors = strdup("BLUE");
  int c;
  while ((c = getopt(argc, argv, "d:t:c:n:i:w:l:s:h:x:P:B:M:a:k:p:g:L:z:r:bvDUKAGHu")) != -1)
    switch (c) {
    case 'd': o.domain = atoi(optarg); break;
    case 't': o.topic = optarg; break;
    case 'c': colors = optarg; break;
    case 'n': o.count = atoi(optarg); break;
    case 'i': o.interval_ms = atoi(optarg); break;
    case 'w': o.wait_s = atoi(optarg); break;
    case 'l': o.linger_ms = atoi(optarg); break;
    case 's': o.size = atoi(optarg); break;
    case 'h': o.depth = atoi(optarg); break;
    case 'x': o.representation = atoi(optarg); break;
    case 'P': o.partitions = optarg; break;
    case 'B': o.blob_octets = atoi(optarg); break;
    case 'M': o.readers = atoi(optarg); break;
    case 'a': o.address = optarg; break;
    case 'k': o.store = optarg; break;
    case 'p': o.name = optarg; break;
    case 'g': o.governance = optarg; break;
    case 'L': o.lease_s = atoi(optarg); break;
    case 'z': o.read_pause_ms = atoi(optarg); break;
    case 'r': o.max_samples = atoi(optarg); break;
    case 'b': o.best_effort = 1; break;
    case 'v': o.is_volatile = 1; break;
    case 'D': o.dispose = 1; break;
    case 'U': o.unregister = 1; break;
    case 'K': o.keyless = 1; break;
    case 'A': o.appendable = 1; break;
    case 'G': o.gate = 1; break;
    case 'H': o.hold = 1; break;
    case 'u': o.unicast = 1; break;
    default: usage(argv[0]);
    }
  if (optind != argc - 1 || (strcmp(argv[optind], "pub") && strcmp(argv[optind], "sub")))
    usage(argv[0]);
  o.is_publisher = !strcmp(argv[optind], "pub");
  for (char *color = strtok(colors, ","); color && o.color_count < 16; color = strtok(NULL, ","))
    o.colors[o.color_count++] = color;
  return o;
}

#endif
