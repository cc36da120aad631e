{{/* Labels of a part, `api` or `worker`, by which it is selected: (list . "api"). */}}
{{- define "esc.selector" -}}
{{- $root := index . 0 -}}
app.kubernetes.io/name: esc
app.kubernetes.io/instance: {{ $root.Release.Name }}
app.kubernetes.io/component: {{ index . 1 }}
{{- end }}

{{/* Name and labels of an object of a part. */}}
{{- define "esc.metadata" -}}
{{- $root := index . 0 -}}
name: {{ $root.Release.Name }}-{{ index . 1 }}
labels:
  {{- include "esc.selector" . | nindent 2 }}
  app.kubernetes.io/version: {{ $root.Chart.AppVersion | quote }}
  app.kubernetes.io/managed-by: {{ $root.Release.Service }}
  helm.sh/chart: {{ $root.Chart.Name }}-{{ $root.Chart.Version }}
{{- end }}

{{/* Pod of a part: without root, as any user, with nothing to write to but /data and /tmp. (list . part command probes) */}}
{{- define "esc.pod" -}}
{{- $root := index . 0 -}}
{{- $part := index . 1 -}}
{{- $values := index $root.Values $part -}}
metadata:
  labels:
    {{- include "esc.selector" . | nindent 4 }}
spec:
  automountServiceAccountToken: false
  # Variables of other Services would look like misspelt settings.
  enableServiceLinks: false
  # Longer than ESC_DRAIN_S.
  terminationGracePeriodSeconds: 45
  securityContext:
    runAsNonRoot: true
    seccompProfile: {type: RuntimeDefault}
  {{- with $root.Values.image.pullSecrets }}
  imagePullSecrets:
    {{- range . }}
    - name: {{ . }}
    {{- end }}
  {{- end }}
  containers:
    - name: esc
      image: {{ printf "%s:%s" $root.Values.image.repository (default $root.Chart.AppVersion $root.Values.image.tag) | quote }}
      args: [{{ index . 2 }}]
      envFrom:
        - secretRef: {name: {{ $root.Values.secret }}}
      env:
        - {name: ESC_BLOB_URL, value: {{ $root.Values.blobUrl | quote }}}
        {{- range $name, $value := $root.Values.settings }}
        - {name: {{ $name }}, value: {{ $value | toString | quote }}}
        {{- end }}
      {{- with index . 3 }}
      {{- . | nindent 6 }}
      {{- end }}
      resources:
        {{- toYaml $values.resources | nindent 8 }}
      securityContext:
        allowPrivilegeEscalation: false
        readOnlyRootFilesystem: true
        capabilities: {drop: [ALL]}
      volumeMounts:
        - {name: data, mountPath: /data}
        - {name: tmp, mountPath: /tmp}
  # The lock of a worker, and uploads while they arrive.
  volumes:
    - {name: data, emptyDir: {}}
    - {name: tmp, emptyDir: {sizeLimit: 2Gi}}
{{- end }}
