/* How long Debian's Cyclone DDS 0.10 (C) takes from the start of a secured participant until it has its first sample.
 *
 *     cyclone_first_sample offer_secret|learn_secret DOMAIN ENCLAVE
 *
 * The one has written a sample that lasts for whoever comes, says so and waits to be ended; the other reads it.  ENCLAVE
 * is a keystore folder in the layout of ROS 2.  Prints JSON, one object a line; the interface comes from CYCLONEDDS_URI.  */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <dds/dds.h>

#include "shapes.h"

#ifndef SECURITY_LIBRARIES
#define SECURITY_LIBRARIES "/usr/lib/x86_64-linux-gnu/libddsc0debian"
#endif

#define PATIENCE DDS_SECS(60)

static dds_entity_t checked(const char *what, dds_entity_t result)
{
  if (result < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(result));
    exit(2);
  }
  return result;
}

static void set_file(dds_qos_t *qos, const char *property, const char *enclave, const char *name)
{
  char value[1024];
  snprintf(value, sizeof value, "file:%s/%s", enclave, name);
  dds_qset_prop(qos, property, value);
}

static void set_plugin(dds_qos_t *qos, const char *service, const char *library, const char *function)
{
  char property[96], value[256];
  snprintf(property, sizeof property, "dds.sec.%s.library.path", service);
  snprintf(value, sizeof value, SECURITY_LIBRARIES "/libdds_security_%s.so", library);
  dds_qset_prop(qos, property, value);
  snprintf(property, sizeof property, "dds.sec.%s.library.init", service);
  snprintf(value, sizeof value, "init_%s", function);
  dds_qset_prop(qos, property, value);
  snprintf(property, sizeof property, "dds.sec.%s.library.finalize", service);
  snprintf(value, sizeof value, "finalize_%s", function);
  dds_qset_prop(qos, property, value);
}

static dds_qos_t *participant_qos(const char *enclave)
{
  dds_qos_t *qos = dds_create_qos();
  set_plugin(qos, "auth", "auth", "authentication");
  set_plugin(qos, "access", "ac", "access_control");
  set_plugin(qos, "crypto", "crypto", "crypto");
  set_file(qos, "dds.sec.auth.identity_ca", enclave, "identity_ca.cert.pem");
  set_file(qos, "dds.sec.auth.identity_certificate", enclave, "cert.pem");
  set_file(qos, "dds.sec.auth.private_key", enclave, "key.pem");
  set_file(qos, "dds.sec.access.permissions_ca", enclave, "permissions_ca.cert.pem");
  set_file(qos, "dds.sec.access.governance", enclave, "governance.p7s");
  set_file(qos, "dds.sec.access.permissions", enclave, "permissions.p7s");
  return qos;
}

static dds_qos_t *endpoint_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(30));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  return qos;
}

static void offer(dds_entity_t participant, dds_entity_t topic)
{
  dds_entity_t writer = checked("writer", dds_create_writer(participant, topic, endpoint_qos(), NULL));
  ShapeType shape = { .color = "BLUE", .x = 1, .y = 20, .shapesize = 30 };
  checked("write", dds_write(writer, &shape));
  dds_sleepfor(DDS_MSECS(200));
  puts("{\"ready\": true}");
  fflush(stdout);
  for (;;)
    dds_sleepfor(PATIENCE);
}

static void learn(dds_entity_t participant, dds_entity_t topic)
{
  dds_entity_t reader = checked("reader", dds_create_reader(participant, topic, endpoint_qos(), NULL));
  dds_entity_t waitset = checked("waitset", dds_create_waitset(participant));
  dds_entity_t condition = checked("condition", dds_create_readcondition(reader, DDS_ANY_STATE));
  checked("attach", dds_waitset_attach(waitset, condition, 0));
  if (checked("wait", dds_waitset_wait(waitset, NULL, 0, PATIENCE)) == 0) {
    fputs("no sample came\n", stderr);
    exit(1);
  }
  void *samples[1] = { NULL };
  dds_sample_info_t info;
  checked("take", dds_take(reader, samples, &info, 1, 1));
  checked("loan", dds_return_loan(reader, samples, 1));
}

int main(int argc, char **argv)
{
  if (argc != 4) {
    fputs("usage: cyclone_first_sample offer_secret|learn_secret DOMAIN ENCLAVE\n", stderr);
    return 2;
  }
  dds_time_t start = dds_time();
  dds_entity_t participant =
    checked("participant", dds_create_participant((dds_domainid_t) atoi(argv[2]), participant_qos(argv[3]), NULL));
  dds_entity_t topic = checked("topic", dds_create_topic(participant, &ShapeType_desc, "Secret", NULL, NULL));
  if (strcmp(argv[1], "offer_secret") == 0)
    offer(participant, topic);
  learn(participant, topic);
  printf("{\"result\": {\"ms\": %.3f, \"processor_ms\": %.3f}}\n", (double) (dds_time() - start) / 1e6,
         (double) clock() * 1e3 / CLOCKS_PER_SEC);
  fflush(stdout);
  dds_delete(participant);
  return 0;
}
