/* A peer over Debian's Cyclone DDS 0.10 (C): publishes or subscribes shapes and blobs, one event a line.
 * docs/multiproc.md has the command line and the events; the interface comes from CYCLONEDDS_URI.  */
#include <dds/dds.h>

#include "payload.h"
#include "shapes.h"

#ifndef SECURITY_LIBRARIES
#define SECURITY_LIBRARIES "/usr/lib/x86_64-linux-gnu/libddsc0debian"
#endif

#define BATCH 8

static struct options o;

/* Large enough for a sample of any of the types.  */
union sample {
  ShapeType shape;
  PlainShape plain;
  OpenShape open;
  Blob blob;
  KeyedBlob keyed_blob;
};

static dds_entity_t checked(const char *what, dds_entity_t result)
{
  if (result < 0) {
    say("ERROR %s: %s", what, dds_strretcode(result));
    exit(2);
  }
  return result;
}

/* --- samples ------------------------------------------------------------------------------------- */

static const dds_topic_descriptor_t *descriptor(void)
{
  switch (kind_of(&o)) {
  case SHAPE: return &ShapeType_desc;
  case PLAIN: return &PlainShape_desc;
  case OPEN: return &OpenShape_desc;
  case BLOB: return &Blob_desc;
  default: return &KeyedBlob_desc;
  }
}

static void fill(union sample *s, int i)
{
  const char *color = o.colors[i % o.color_count];
  switch (kind_of(&o)) {
  case SHAPE:
  case PLAIN: /* the two are laid out alike */
    snprintf(s->shape.color, sizeof s->shape.color, "%s", color);
    s->shape.x = i, s->shape.y = 2 * i, s->shape.shapesize = o.size;
    break;
  case OPEN:
    snprintf(s->open.color, sizeof s->open.color, "%s", color);
    s->open.x = i, s->open.y = 2 * i, s->open.shapesize = o.size;
    s->open.tint = (uint8_t) i, s->open.angle = 0.5 * i, s->open.stamp = ((int64_t) i << 32) + 1;
    break;
  default: /* so are the two blobs */
    s->blob.id = i;
    fill_blob(s->blob.data._buffer, s->blob.data._length, i);
  }
}

static void say_sample(const char *event, const union sample *s)
{
  switch (kind_of(&o)) {
  case SHAPE:
  case PLAIN:
    say("%s %s %d %d %d", event, s->shape.color, s->shape.x, s->shape.y, s->shape.shapesize);
    break;
  case OPEN:
    if (s->open.tint != (uint8_t) s->open.x || s->open.angle != 0.5 * s->open.x
        || s->open.stamp != ((int64_t) s->open.x << 32) + 1) {
      say("ERROR %s: tint %d angle %g stamp %lld", event, s->open.tint, s->open.angle, (long long) s->open.stamp);
      exit(2);
    }
    say("%s %s %d %d %d", event, s->open.color, s->open.x, s->open.y, s->open.shapesize);
    break;
  default:
    say("%s %d %u %08x", event, s->blob.id, s->blob.data._length,
        crc32_of(s->blob.data._buffer, s->blob.data._length));
  }
}

static void say_key(const char *event, const union sample *s)
{
  if (o.blob_octets >= 0)
    say("%s %d", event, s->blob.id);
  else
    say("%s %s", event, kind_of(&o) == OPEN ? s->open.color : s->shape.color);
}

/* --- qualities of service ------------------------------------------------------------------------ */

static dds_qos_t *endpoint_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  dds_history_kind_t history = o.depth > 0 ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL;
  dds_qset_reliability(qos, o.best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, o.is_volatile ? DDS_DURABILITY_VOLATILE : DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, history, o.depth);
  /* What late joiners get is Cyclone's durability service; it would keep one sample of each instance.  */
  dds_qset_durability_service(qos, 0, history, o.depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED);
  if (o.max_samples)
    dds_qset_resource_limits(qos, o.max_samples, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  /* An unregister must not arrive as a dispose.  */
  dds_qset_writer_data_lifecycle(qos, false);
  if (o.representation) {
    dds_data_representation_id_t id = o.representation == 2 ? DDS_DATA_REPRESENTATION_XCDR2
                                                            : DDS_DATA_REPRESENTATION_XCDR1;
    dds_qset_data_representation(qos, 1, &id);
  }
  return qos;
}

static dds_qos_t *group_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  const char *names[8];
  uint32_t count = 0;
  if (o.partitions) {
    char *list = strdup(o.partitions);
    for (char *name = strtok(list, ","); name && count < 8; name = strtok(NULL, ","))
      names[count++] = name;
    dds_qset_partition(qos, count, names);
  }
  return qos;
}

static void set_file(dds_qos_t *qos, const char *property, const char *prefix, const char *suffix)
{
  char value[1024];
  snprintf(value, sizeof value, "file:%s/%s%s", o.store, prefix, suffix);
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

static dds_qos_t *participant_qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  if (o.store) {
    set_plugin(qos, "auth", "auth", "authentication");
    set_plugin(qos, "access", "ac", "access_control");
    set_plugin(qos, "crypto", "crypto", "crypto");
    set_file(qos, "dds.sec.auth.identity_ca", "identity_ca", ".pem");
    set_file(qos, "dds.sec.auth.identity_certificate", o.name, ".pem");
    set_file(qos, "dds.sec.auth.private_key", o.name, ".key");
    set_file(qos, "dds.sec.access.permissions_ca", "permissions_ca", ".pem");
    set_file(qos, "dds.sec.access.governance", o.governance, "");
    set_file(qos, "dds.sec.access.permissions", o.name, ".permissions.p7s");
    if (has_revocation_list(&o))
      set_file(qos, "org.eclipse.cyclonedds.sec.auth.crl", REVOCATION_LIST, "");
  }
  return qos;
}

/* --- the two roles ------------------------------------------------------------------------------- */

static int publish(dds_entity_t participant, dds_entity_t topic)
{
  dds_entity_t publisher = checked("publisher", dds_create_publisher(participant, group_qos(), NULL));
  dds_entity_t writer = checked("writer", dds_create_writer(publisher, topic, endpoint_qos(), NULL));
  dds_publication_matched_status_t status = { 0 };
  for (int t = 0; t < o.wait_s * 100 && (int) status.current_count < o.readers; t++) {
    checked("matched", dds_get_publication_matched_status(writer, &status));
    dds_sleepfor(DDS_MSECS(10));
  }
  if ((int) status.current_count < o.readers) {
    say("TIMEOUT %u of %d readers", status.current_count, o.readers);
    return 1;
  }
  say("MATCHED %u", status.current_count);
  wait_at_gate(&o);
  union sample s;
  memset(&s, 0, sizeof s);
  if (o.blob_octets >= 0) {
    s.blob.data._length = s.blob.data._maximum = (uint32_t) o.blob_octets;
    s.blob.data._buffer = malloc((size_t) o.blob_octets + 1);
  }
  for (int i = 0; i < o.count; i++) {
    fill(&s, i);
    checked("write", dds_write(writer, &s));
    say_sample("WROTE", &s);
    dds_sleepfor(DDS_MSECS(o.interval_ms));
  }
  if (o.dispose) {
    checked("dispose", dds_dispose(writer, &s));
    say_key("DISPOSED", &s);
  }
  if (o.unregister) {
    checked("unregister", dds_unregister_instance(writer, &s));
    say_key("UNREGISTERED", &s);
  }
  if (!o.best_effort)
    say(dds_wait_for_acks(writer, DDS_SECS(o.wait_s)) == 0 ? "ACKED" : "NOT-ACKED");
  leave_slowly(&o);
  say("DONE %d", o.count);
  return 0;
}

static struct { int samples, disposed, without_writers; } seen;

static int is_complete(void)
{
  return seen.samples >= o.count && (!o.dispose || seen.disposed) && (!o.unregister || seen.without_writers);
}

/* Takes what is there and says it; false if there was nothing.  */
static int take_some(dds_entity_t reader)
{
  static uint32_t matched;
  dds_subscription_matched_status_t status;
  checked("matched", dds_get_subscription_matched_status(reader, &status));
  if (status.current_count != matched)
    say("MATCHED %u", matched = status.current_count);
  void *samples[BATCH] = { NULL };
  dds_sample_info_t infos[BATCH];
  int count = checked("take", dds_take(reader, samples, infos, BATCH, o.read_pause_ms ? 1 : BATCH));
  for (int i = 0; i < count; i++) {
    if (infos[i].valid_data) {
      say_sample("SAMPLE", samples[i]);
      seen.samples++;
    }
    if (infos[i].instance_state == DDS_IST_NOT_ALIVE_DISPOSED) {
      /* Samples that are taken after the dispose bear its state as well: it is said once for an instance.  */
      static dds_instance_handle_t told;
      if (told != infos[i].instance_handle)
        say_key("DISPOSED", samples[i]);
      told = infos[i].instance_handle;
      seen.disposed = 1;
    } else if (infos[i].instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS && !infos[i].valid_data) {
      say_key("NO-WRITERS", samples[i]);
      seen.without_writers = 1;
    }
  }
  if (count > 0)
    dds_return_loan(reader, samples, count);
  dds_sleepfor(DDS_MSECS(o.read_pause_ms * count));
  return count > 0;
}

static int subscribe(dds_entity_t participant, dds_entity_t topic)
{
  dds_entity_t subscriber = checked("subscriber", dds_create_subscriber(participant, group_qos(), NULL));
  dds_entity_t reader = checked("reader", dds_create_reader(subscriber, topic, endpoint_qos(), NULL));
  dds_time_t end = dds_time() + DDS_SECS(o.wait_s);
  while (!is_complete() && dds_time() < end)
    if (!take_some(reader))
      dds_sleepfor(DDS_MSECS(5));
  if (!is_complete()) {
    say("TIMEOUT %d of %d", seen.samples, o.count);
    return 1;
  }
  if (o.hold)
    say("HOLDING");
  end = dds_time() + DDS_MSECS(o.linger_ms);
  while (o.hold ? !is_released() : dds_time() < end) /* what still comes is too much, and said */
    if (!take_some(reader))
      dds_sleepfor(DDS_MSECS(5));
  say("DONE %d", seen.samples);
  return 0;
}

int main(int argc, char **argv)
{
  o = parse_options(argc, argv);
  dds_entity_t participant =
    checked("participant", dds_create_participant((dds_domainid_t) o.domain, participant_qos(), NULL));
  dds_guid_t guid;
  char hex[33];
  checked("guid", dds_get_guid(participant, &guid));
  for (int i = 0; i < 16; i++)
    sprintf(hex + 2 * i, "%02x", guid.v[i]);
  say("GUID %s", hex);
  dds_entity_t topic = checked("topic", dds_create_topic(participant, descriptor(), o.topic, NULL, NULL));
  int status = o.is_publisher ? publish(participant, topic) : subscribe(participant, topic);
  dds_delete(participant);
  return status;
}
